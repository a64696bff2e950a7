// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace dual_proxy {

/** "name[index]": an entry of a list, as errors name it. */
std::string EntryName(const std::string& name, std::size_t index);

/** Checks spans of time, s: [start, end] each, from 0 on, the end later.
@throws std::invalid_argument naming the entry, as validate.h does. */
void ThrowUnlessSpans(const char* who, const char* field,
                      const std::vector<Eigen::Vector2d>& spans);

}  // namespace dual_proxy
