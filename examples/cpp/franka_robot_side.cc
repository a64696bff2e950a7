// SPDX-License-Identifier: BSD-3-Clause
// The robot side with a Panda or FR3, in C++: a scenario's scheme, controller
// and map, the arm's own estimate of the force, frames of link/wire_format.h by
// UDP on this machine. For tests: nothing authenticates the other end, and no
// real-time kernel is asked for.
//
//     franka_robot_side SCENARIO.yaml HOST PORT PEER_PORT [--yes] [--gripper]
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <exception>
#include <iostream>
#include <random>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>

#include "dual_proxy/drivers/franka/libfranka.h"
#include "dual_proxy/drivers/hardware_defaults.h"
#include "dual_proxy/experiment/teleop_loop_params.h"
#include "dual_proxy/link/link_end.h"
#include "dual_proxy/station/panda.h"
#include "dual_proxy/station/teleop_station.h"

namespace dual_proxy {
namespace {

using Side = FrankaRobotSide<Libfranka>;
using Gripper = FrankaGripper<Libfranka>;

volatile std::sig_atomic_t interrupted = 0;

/** UDP from a port of this machine to another. */
class LoopbackSocket {
 public:
  LoopbackSocket(int port, int peer_port)
      : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
    const sockaddr_in own = MakeAddress(port);
    const sockaddr_in peer = MakeAddress(peer_port);
    if (bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0 ||
        connect(fd_, reinterpret_cast<const sockaddr*>(&peer), sizeof peer)) {
      throw std::runtime_error("cannot use UDP port " + std::to_string(port));
    }
  }
  ~LoopbackSocket() { close(fd_); }
  LoopbackSocket(const LoopbackSocket&) = delete;
  LoopbackSocket& operator=(const LoopbackSocket&) = delete;

  /** @returns what has come, nothing if nothing has. */
  std::span<const std::uint8_t> Receive() {
    const ssize_t size =
        recv(fd_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    return {buffer_.data(), size > 0 ? static_cast<std::size_t>(size) : 0};
  }
  void Send(const FrameBytes& bytes) {
    // A peer that is not there yet is no error.
    static_cast<void>(send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT));
  }

 private:
  static sockaddr_in MakeAddress(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return address;
  }

  int fd_;
  std::array<std::uint8_t, 2048> buffer_{};
};

// Says in one line what there is to say of the gripper.
std::string DescribeGripper(Gripper* gripper) {
  const FrankaGripperStatus& status = gripper->GetStatus();
  return ", fingers at " + std::to_string(1e3 * status.width) + " mm after " +
         std::to_string(status.moves) + " moves" +
         (gripper->fault().empty() ? "" : " (" + gripper->fault() + ")");
}

void ServeLink(const std::atomic<bool>& done, LoopbackSocket* socket,
               Side* side, Gripper* gripper) {
  const LinkEnd end(LinkDirection::kToHaptic,
                    side->cycle().params().side.proxy.link, {});
  LinkEndState link = end.MakeState(std::random_device()());
  double next_line = 0;
  while (!done) {
    const double now = MonotonicTime();
    while (true) {
      const std::span<const std::uint8_t> bytes = socket->Receive();
      if (bytes.empty()) break;
      end.Receive(now, bytes, &link);
    }
    side->SetMessage(link.message);
    const FrankaStatus& status = side->GetStatus();
    const bool holds = status.phase != FrankaPhase::kRunning ||
                       status.hold != HoldReason::kNone;
    if (end.Send(now, side->GetMessage(), holds ? kLinkHolding : 0, &link)) {
      socket->Send(link.bytes);
    }
    if (gripper && !holds && std::isfinite(link.message.gripper_opening)) {
      gripper->Command(status.gripper_width);
    }
    if (interrupted) side->Stop();
    if (now >= next_line) {
      next_line = now + 1;
      std::cout << EnumToString(status.phase) << " ("
                << EnumToString(status.hold) << ") at "
                << status.X_BE.p.transpose() << " m, force "
                << status.sensed_wrench.head<3>().transpose() << " N, "
                << status.lost_cycles << " cycles lost, " << status.reflexes
                << " reflexes, " << status.recoveries << " recoveries"
                << (gripper ? DescribeGripper(gripper) : "") << std::endl;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

int Run(const std::string& path, const std::string& host, int port,
        int peer_port, bool yes, bool has_gripper) {
  const Scenario scenario = LoadScenario(path);
  const PandaModel model(scenario.scene.tool_mass, scenario.scene.gravity);
  auto loop = MakeTeleopLoopParams<SerialArm<7>>(scenario, model.arm_params());
  loop.robot.gripper.enabled = has_gripper;
  FrankaRobotSideParams params;
  params.host = host;
  params.real_time = false;
  params.push_test = !yes;
  params.load = {.mass = scenario.scene.tool_mass,
                 .com = kToolCom,
                 .inertia = kToolMoments.asDiagonal()};
  Side side(params, {.side = MakeHardwareDefaults(loop.robot),
                     .model = loop.model,
                     .sensor = loop.sensor,
                     .p_SE = loop.p_SE});
  LoopbackSocket socket(port, peer_port);
  Gripper gripper;
  if (has_gripper) gripper.Open(host);
  std::atomic<bool> done{false};
  std::exception_ptr error;
  std::thread arm([&] {
    try {
      side.Run([yes](const std::string& question) {
        std::cout << question << (yes ? " yes" : " [y/N] ") << std::endl;
        std::string answer;
        return yes || (std::getline(std::cin, answer) && answer == "y");
      });
    } catch (...) {
      error = std::current_exception();
    }
    done = true;
  });
  ServeLink(done, &socket, &side, has_gripper ? &gripper : nullptr);
  arm.join();
  const CycleStatistics& statistics = side.statistics();
  std::cout << statistics.count() << " cycles: median "
            << 1e6 * statistics.Quantile(0.5) << " us, 99.9 % "
            << 1e6 * statistics.Quantile(0.999) << " us, worst "
            << 1e6 * statistics.max() << " us\n";
  if (error) std::rethrow_exception(error);
  return 0;
}

}  // namespace
}  // namespace dual_proxy

int main(int argc, char* argv[]) {
  const std::set<std::string> options(argv + std::min(argc, 5), argv + argc);
  const bool yes = options.contains("--yes");
  const bool gripper = options.contains("--gripper");
  if (argc != 5 + static_cast<int>(yes) + static_cast<int>(gripper)) {
    std::cerr << "usage: franka_robot_side SCENARIO.yaml HOST PORT PEER_PORT "
                 "[--yes] [--gripper]\n";
    return 2;
  }
  std::signal(SIGINT, [](int) { dual_proxy::interrupted = 1; });
  std::signal(SIGTERM, [](int) { dual_proxy::interrupted = 1; });
  try {
    return dual_proxy::Run(argv[1], argv[2], std::stoi(argv[3]),
                           std::stoi(argv[4]), yes, gripper);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 3;
  }
}
