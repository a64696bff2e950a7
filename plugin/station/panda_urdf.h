// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace dual_proxy {

/** The text of plugin/dual_proxy/models/panda.urdf: the arm up to its flange.
 */
extern const char* const kPandaUrdf;

}  // namespace dual_proxy
