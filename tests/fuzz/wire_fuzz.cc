// SPDX-License-Identifier: BSD-3-Clause
// Whatever bytes come to the end of a link, between those of a live sender and
// whatever the clocks say: what is no frame is refused, what is one is encoded
// as it was, and only what the sender has sent is let through, once, in order,
// to a half that stays well.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "dual_proxy/link/link_end.h"
#include "dual_proxy/schemes/dual_proxy/scheme.h"
#include "fuzz_tools.h"

namespace dual_proxy {
namespace {

constexpr int kMostFrames = 300;

// As they come.
void CheckBytes(const std::vector<std::uint8_t>& bytes) {
  int taken = 0;
  for (const LinkDirection direction :
       {LinkDirection::kToRobot, LinkDirection::kToHaptic}) {
    LinkFrame frame;
    const WireError error = DecodeFrame(bytes, direction, &frame);
    Require(DescribeWireError(error)[0] != '\0', "a text of every error");
    if (error != WireError::kNone) continue;
    ++taken;
    const FrameBytes again = EncodeFrame(frame);
    Require(bytes.size() == again.size() &&
                std::equal(again.begin(), again.end(), bytes.begin()),
            "a frame is encoded as it was");
    Require(IsFinite(frame.message) && std::isfinite(frame.time) &&
                std::isfinite(frame.echo.time) && frame.echo.age >= 0,
            "a frame's numbers are finite");
    Require(frame.session != 0 && frame.message.sequence >= -1,
            "a frame's session and sequence");
  }
  Require(taken <= 1, "a frame goes one way");
}

// A robot side, the haptic side that talks to it, and somebody between.
class Link {
 public:
  void Run(FuzzInput* input) {
    for (int i = 0; i < kMostFrames && !input->empty(); ++i) Step(input);
  }

 private:
  void Step(FuzzInput* input) {
    const int what = input->Byte();
    time_ += 1e-4 * input->Byte();
    if (what >= 240) time_ += input->Number();
    if (what >= 224 && what < 240) peer_clock_ += input->Number();
    SendTrue(what % 4 == 0);
    switch (what % 8) {
      case 0:
      case 1:
        break;
      case 2:
      case 3:
        Offer(Old(input));
        break;
      case 4:
        Offer(Changed(input, Old(input)));
        break;
      case 5:
        Offer(Changed(input, newest_));
        break;
      case 6:
        Offer(newest_);
        Offer(newest_);
        break;
      default: {
        std::vector<std::uint8_t> noise(input->Index(600));
        for (std::uint8_t& byte : noise) {
          byte = static_cast<std::uint8_t>(input->Byte());
        }
        Offer(noise);
      }
    }
    if (what % 2 == 0) Offer(newest_);
    TakeBack();
    UpdateHalf();
  }

  // The next frame of the haptic side, with a message that says which it is.
  void SendTrue(bool new_message) {
    if (new_message || sequence_ < 0) {
      PoseMessage content;
      content.sequence = ++sequence_;
      content.send_time = time_ + peer_clock_;
      content.pose.p.x() = 1e-6 * static_cast<double>(sequence_);
      message_ = ToMessage(content);
    }
    if (haptic_.Send(time_ + peer_clock_, message_, 0, &haptic_state_)) {
      newest_.assign(haptic_state_.bytes.begin(), haptic_state_.bytes.end());
      sent_.push_back(newest_);
    }
  }

  void TakeBack() {
    if (robot_.Send(time_, half_state_.output.message, kLinkHolding,
                    &robot_state_)) {
      haptic_.Receive(time_ + peer_clock_, robot_state_.bytes, &haptic_state_);
    }
  }

  std::vector<std::uint8_t> Old(FuzzInput* input) const {
    if (sent_.empty()) return {};
    return sent_[static_cast<std::size_t>(
        input->Index(static_cast<int>(sent_.size())))];
  }

  static std::vector<std::uint8_t> Changed(FuzzInput* input,
                                           std::vector<std::uint8_t> bytes) {
    if (bytes.empty()) return bytes;
    const int kind = input->Byte() % 4;
    const auto at =
        static_cast<std::size_t>(input->Index(static_cast<int>(bytes.size())));
    if (kind == 0) {
      bytes[at] ^= static_cast<std::uint8_t>(1 << input->Byte() % 8);
    } else if (kind == 1) {
      bytes[at] = static_cast<std::uint8_t>(input->Byte());
    } else if (kind == 2) {
      bytes.resize(at);
    } else {
      const double number = input->Number();
      const std::size_t begin = std::min(at / 8 * 8, bytes.size() - 8);
      std::memcpy(bytes.data() + begin, &number, sizeof(number));
    }
    return bytes;
  }

  void Offer(const std::vector<std::uint8_t>& bytes) {
    CheckBytes(bytes);
    const LinkEndState before = robot_state_;
    const FrameVerdict verdict = robot_.Receive(time_, bytes, &robot_state_);
    std::int64_t count = 0;
    for (std::size_t i = 0; i < kFrameVerdicts; ++i) {
      count += robot_state_.verdicts[i] - before.verdicts[i];
    }
    Require(count == 1, "what comes is counted once");
    LinkFrame frame;
    const bool is_frame =
        DecodeFrame(bytes, LinkDirection::kToRobot, &frame) == WireError::kNone;
    Require(is_frame || verdict == FrameVerdict::kMalformed ||
                !std::isfinite(time_),
            "no frame, no verdict but that");
    Require(robot_state_.lost >= before.lost, "no count overflows");
    Require(std::isfinite(robot_state_.clock.offset) &&
                std::isfinite(robot_state_.clock.round_trip) &&
                robot_state_.clock.round_trip >= 0,
            "a clock's numbers");
    if (verdict != FrameVerdict::kAccepted) {
      Require(robot_state_.message.sequence == before.message.sequence,
              "what is not accepted changes no message");
      return;
    }
    Require(frame.session == robot_state_.peer, "one sender is heard");
    Require(frame.session != before.peer || frame.number > before.peer_number,
            "its frames are taken in order");
    Require(frame.echo.session == robot_state_.session, "it hears this end");
    Require(IsFinite(robot_state_.message), "a finite message");
    // Of somebody between, who can change what is true, mTLS is to keep out;
    // but what was not changed is what was sent.
    if (std::find(sent_.begin(), sent_.end(), bytes) != sent_.end()) {
      Require(robot_state_.message.body == frame.message.body,
              "a message is what was sent");
    }
  }

  void UpdateHalf() {
    half_.Update(time_, {.message = robot_state_.message}, &half_state_);
    const RobotHalfOutput& output = half_state_.output;
    Require(output.setpoint.motion_error.allFinite() &&
                output.setpoint.velocity.allFinite() &&
                output.proxy_pose.p.allFinite(),
            "a half's setpoint is finite");
    Require(output.setpoint.motion_error.norm() <=
                half_params_.proxy.max_motion_error * (1 + 1e-9),
            "a half's motion error is bounded");
  }

  double time_{100};
  double peer_clock_{-7};
  std::int64_t sequence_{-1};
  Message message_;
  std::vector<std::uint8_t> newest_;
  std::vector<std::vector<std::uint8_t>> sent_;
  LinkEnd robot_{LinkDirection::kToHaptic, LinkMonitorParams{},
                 LinkEndParams{}};
  LinkEnd haptic_{LinkDirection::kToRobot, LinkMonitorParams{},
                  LinkEndParams{}};
  LinkEndState robot_state_{robot_.MakeState(1111)};
  LinkEndState haptic_state_{haptic_.MakeState(2222)};
  RobotHalfParams half_params_;
  DualProxyRobotHalf half_{half_params_};
  DualProxyRobotHalf::State half_state_{half_.MakeState()};
};

void Run(const std::uint8_t* data, std::size_t size) {
  if (size > 0 && data[0] == 'D') {
    CheckBytes({data, data + size});
    return;
  }
  FuzzInput input(data, size);
  std::make_unique<Link>()->Run(&input);
}

}  // namespace
}  // namespace dual_proxy

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  dual_proxy::Run(data, size);
  return 0;
}
