// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/panda_scene_params.h"

#include <set>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

void BoxParams::Validate() const {
  constexpr const char* kWho = "BoxParams";
  ThrowUnlessFinite(kWho, "center", center);
  ThrowUnlessAllInRange(kWho, "size", size, 1e-4, 10);
  ThrowUnlessFinite(kWho, "yaw", Eigen::Matrix<double, 1, 1>(yaw));
  ThrowUnlessAllInRange(kWho, "color", color, 0, 1);
}

void PandaSceneParams::Validate() const {
  constexpr const char* kWho = "PandaSceneParams";
  ThrowUnlessInRange(kWho, "table_height", table_height, 1e-3, 1.5);
  ThrowUnlessFinite(kWho, "table_center", table_center);
  ThrowUnlessAllInRange(kWho, "table_size", table_size, 1e-3, 10);
  std::set<std::string> names{"table"};
  std::string found;
  for (const BoxParams& box : boxes) {
    box.Validate();
    names.insert(box.name);
    found += (found.empty() ? "'" : ", '") + box.name + "'";
  }
  ThrowUnlessInRange(kWho, "friction", friction, 0, 5);
  ThrowUnlessInRange(kWho, "contact_stiffness", contact_stiffness, 1, 1e8);
  ThrowUnlessInRange(kWho, "contact_dissipation", contact_dissipation, 0, 1e3);
  ThrowUnlessInRange(kWho, "relaxation_time", relaxation_time, 0, 10);
  ThrowUnlessInRange(kWho, "time_step", time_step, 1e-5, 1e-2);
  ThrowUnlessInRange(kWho, "tool_size", tool_size, 0.005, 0.2);
  ThrowUnlessInRange(kWho, "tool_mass", tool_mass, 1e-3, 3);
  ThrowUnlessInRange(kWho, "gravity", gravity, 0, 100);
  ThrowUnlessAllInRange(kWho, "start_position", start_position, -2, 2);
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
