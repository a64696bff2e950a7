// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/panda_scene_params.h"

#include <set>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

void BoxParams::Validate() const { ValidateFields("BoxParams", *this); }

void PandaSceneParams::Validate() const {
  constexpr const char* kWho = "PandaSceneParams";
  ValidateFields(kWho, *this);
  std::set<std::string> names{"table"};
  std::string found;
  for (const BoxParams& box : boxes) {
    names.insert(box.name);
    found += (found.empty() ? "'" : ", '") + box.name + "'";
  }
  if (names.size() != boxes.size() + 1 || names.contains("")) {
    throw InvalidField(kWho, "boxes",
                       "expected names used once, not empty and not 'table', "
                       "got [" +
                           found + "]");
  }
}

std::vector<Eigen::Vector3d> PandaSceneParams::Corners() const {
  const double half = tool_size / 2;
  return {{half, half, -kCornerRadius},
          {half, -half, -kCornerRadius},
          {-half, half, -kCornerRadius},
          {-half, -half, -kCornerRadius}};
}

std::vector<BoxParams> PandaSceneParams::AllBoxes() const {
  BoxParams table;
  table.name = "table";
  table.center << table_center, table_height / 2;
  table.size << table_size, table_height;
  std::vector<BoxParams> all{table};
  all.insert(all.end(), boxes.begin(), boxes.end());
  return all;
}

}  // namespace dual_proxy
