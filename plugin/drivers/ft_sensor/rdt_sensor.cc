// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/ft_sensor/rdt_sensor.h"

#include <netdb.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <limits>
#include <memory>
#include <system_error>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/drivers/clock.h"

namespace dual_proxy {
namespace {

constexpr std::chrono::seconds kOpenTimeout{1};
/** ms: the longest that the thread waits, and so Close(). */
constexpr int kLongestWait = 10;
/** Datagrams in a row, after which the thread looks at what else there is. */
constexpr int kMostInARow = 256;
/** s: the longest that a datagram can have waited to be read; more is the
system's clock that was set. */
constexpr double kLongestQueue = 10;

std::string ErrorText(int error) {
  return std::generic_category().message(error);
}

using Addresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

/** @throws DriverError */
Addresses Find(const std::string& host, int port, int family, int flags) {
  addrinfo hints{};
  hints.ai_family = family;
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = flags | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int status = getaddrinfo(host.empty() ? nullptr : host.c_str(),
                                 std::to_string(port).c_str(), &hints, &found);
  if (status != 0) {
    throw DriverError("force sensor " + host + ": " + gai_strerror(status));
  }
  return {found, &freeaddrinfo};
}

/** A UDP socket that sends to the sensor and receives from it alone.
@throws DriverError */
int Connect(const RdtSensorParams& params) {
  const Addresses remote = Find(params.host, params.port, AF_UNSPEC, 0);
  const int descriptor =
      socket(remote->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto check = [descriptor](int result, const std::string& what) {
    if (result >= 0) return;
    const int error = errno;
    if (descriptor >= 0) close(descriptor);
    throw DriverError("force sensor: " + what + ": " + ErrorText(error));
  };
  check(descriptor, "UDP socket");
  const int on = 1;
  check(setsockopt(descriptor, SOL_SOCKET, SO_TIMESTAMP, &on, sizeof(on)),
        "time of arrival");
  if (!params.local_address.empty() || params.local_port != 0) {
    Addresses local(nullptr, &freeaddrinfo);
    try {
      local = Find(params.local_address, params.local_port, remote->ai_family,
                   AI_PASSIVE);
    } catch (const DriverError&) {
      close(descriptor);
      throw;
    }
    check(bind(descriptor, local->ai_addr, local->ai_addrlen),
          "local address " + params.local_address + ", port " +
              std::to_string(params.local_port));
  }
  check(connect(descriptor, remote->ai_addr, remote->ai_addrlen), params.host);
  return descriptor;
}

/** s: how long a datagram has been here, by its stamp. */
double CalcWait(msghdr* message) {
  for (cmsghdr* part = CMSG_FIRSTHDR(message); part != nullptr;
       part = CMSG_NXTHDR(message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMP) {
      continue;
    }
    timeval arrival{};
    timeval now{};
    std::memcpy(&arrival, CMSG_DATA(part), sizeof(arrival));
    gettimeofday(&now, nullptr);
    const double wait =
        static_cast<double>(now.tv_sec - arrival.tv_sec) +
        1e-6 * static_cast<double>(now.tv_usec - arrival.tv_usec);
    return wait >= 0 && wait < kLongestQueue ? wait : 0;
  }
  return 0;
}

/** While it lives, threads are made that no signal is delivered to: signals are
for who waits for them. */
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace

RdtSensor::RdtSensor(const RdtSensorParams& params)
    : params_(params), stream_(params) {}

void RdtSensor::Open() {
  Close();
  stream_ = RdtStream(params_);
  error_ = 0;
  socket_ = Connect(params_);
  stop_ = false;
  try {
    const SignalsBlocked blocked;
    thread_ = std::thread([this] { Serve(); });
  } catch (const std::system_error& error) {
    Close();
    throw DriverError("force sensor: " + std::string(error.what()));
  }
  Report report;
  {
    std::unique_lock lock(mutex_);
    reported_.wait_for(lock, kOpenTimeout, [this] { return report_.valid; });
    report = report_;
  }
  if (report.valid) return;
  Close();
  throw DriverError(Describe(report));
}

void RdtSensor::Close() noexcept {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
}

std::string RdtSensor::fault() const {
  const std::scoped_lock lock(mutex_);
  return Describe(report_);
}

RdtCounts RdtSensor::counts() const {
  const std::scoped_lock lock(mutex_);
  return report_.counts;
}

void RdtSensor::Serve() noexcept {
  double asked = -std::numeric_limits<double>::infinity();
  while (!stop_) {
    const double now = MonotonicTime();
    if (now - std::max(asked, stream_.last_arrival()) > params_.silence) {
      stream_.NoteRequest();
      Send(RdtCommand::kStream);
      asked = now;
      Publish();
    }
    pollfd waiting{.fd = socket_, .events = POLLIN, .revents = 0};
    if (poll(&waiting, 1, kLongestWait) > 0) {
      Receive();
      Publish();
    }
  }
  Send(RdtCommand::kStop);
  stream_.Close();
  Publish();
}

void RdtSensor::Send(RdtCommand command) noexcept {
  const auto request = EncodeRdtRequest(command);
  if (send(socket_, request.data(), request.size(), MSG_DONTWAIT) < 0) {
    error_ = errno;
  }
}

void RdtSensor::Receive() noexcept {
  // A byte more than a record, so that what is longer is seen.
  std::array<std::uint8_t, kRdtRecordSize + 1> datagram;
  alignas(cmsghdr) std::array<char, 64> control;
  for (int i = 0; i < kMostInARow; ++i) {
    iovec part{.iov_base = datagram.data(), .iov_len = datagram.size()};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = recvmsg(socket_, &message, MSG_DONTWAIT);
    if (size < 0) {
      if (errno != EAGAIN && errno != EINTR) error_ = errno;
      return;
    }
    const double time = MonotonicTime() - CalcWait(&message);
    const std::int64_t taken = stream_.counts().taken;
    stream_.Take({datagram.data(), static_cast<std::size_t>(size)}, time);
    if (stream_.counts().taken > taken) error_ = 0;
  }
}

void RdtSensor::Publish() noexcept {
  latest_.Set(stream_.reading());
  {
    const std::scoped_lock lock(mutex_);
    report_ = {.fault = stream_.fault(),
               .status = stream_.status(),
               .error = error_,
               .valid = stream_.reading().valid,
               .counts = stream_.counts()};
  }
  reported_.notify_all();
}

std::string RdtSensor::Describe(const Report& report) const {
  const std::string who = "force sensor " + params_.host + ", port " +
                          std::to_string(params_.port) + ": ";
  switch (report.fault) {
    case RdtFault::kNone:
      return "";
    case RdtFault::kClosed:
      return who + "not open";
    case RdtFault::kSilent:
      return who + "no record for " + NumberText(params_.silence) + " s" +
             (report.error != 0 ? " (" + ErrorText(report.error) + ")" : "") +
             "; check power, cable and address, that RDT is enabled, and that "
             "no other program asks for its stream";
    case RdtFault::kStatus:
      return who + "it reports status " + DescribeRdtStatus(report.status);
    case RdtFault::kRange:
      return who + "a value beyond max_force (" +
             NumberText(params_.max_force) + " N) or max_moment (" +
             NumberText(params_.max_moment) + " N m)";
    default:
      return who + "the same values for " + NumberText(params_.frozen_time) +
             " s";
  }
}

}  // namespace dual_proxy
