// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of Clutch. */
struct ClutchParams {
  double release_time{0.1};
  double engage_time{0.6};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("release_time", &release_time, Above(0), "s",
                   "in which a pressed clutch takes the force off the hand"));
    a->Visit(Field("engage_time", &engage_time, Above(0), "s",
                   "in which it comes back; 12 N in 0.6 s are 20 N/s"));
  }
};

/** Memory of Clutch, and its results. */
struct ClutchState {
  /** X_DH from the home that the clutch has moved: what is to be sent. It is
  not valid if the handle's pose is not. */
  Pose pose;
  /** The last such pose that was valid; the home before there was one. */
  Pose held;
  /** Of `pose` over the handle's: position by a sum, rotation by a product. */
  Pose offset;
  bool clutched{false};  ///< Whether `pose` stands still.
  bool moved{false};     ///< Whether there is an offset.
  double engagement{1};  ///< Share of the force that the hand is to feel.
};

/** Moves the device's home, so that the hand can go back to the middle of its
workspace while the robot keeps its place (indexing):

    pressed:   what is sent is what was sent last
    released:  p = p_handle + p_offset,  R = R_offset R_handle

with the offset for which nothing jumps as it is released. The robot cannot tell
a pressed clutch from a hand at rest: it holds its place, and its force. The
hand feels nothing; after it, its force grows from zero, linearly.

Before anything was sent the home is held. A clutch that is released while the
handle's pose is not valid stays pressed until it is.

Update() neither allocates nor throws. */
class Clutch {
 public:
  /** @param period  s, > 0: between two calls of Update().
  @throws std::invalid_argument if an argument is not valid. */
  Clutch(const ClutchParams& params, double period);

  ClutchState MakeState() const { return {}; }

  /** Advances by one period; results are in `state`.
  @param X_DH  of the handle, from the device's own home. */
  void Update(bool pressed, const Pose& X_DH,
              ClutchState* state) const noexcept;

 private:
  double release_step_;
  double engage_step_;
};

}  // namespace dual_proxy
