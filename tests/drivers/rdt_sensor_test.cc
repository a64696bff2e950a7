// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/ft_sensor/rdt_sensor.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "dual_proxy/drivers/clock.h"
#include "no_alloc.h"
#include "rdt_datagram.h"

namespace dual_proxy {
namespace {

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// A UDP socket on loopback at a port of its own.
class Socket {
 public:
  Socket() : descriptor_(socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address = Loopback(0);
    bind(descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof(address));
    socklen_t size = sizeof(address);
    getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    const timeval wait{.tv_sec = 0, .tv_usec = 1000};
    setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof(wait));
  }
  ~Socket() { close(descriptor_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  int port() const { return port_; }

  // The command of a request that comes within a millisecond; -1: none.
  int Receive(sockaddr_in* from) {
    std::array<std::uint8_t, 16> bytes{};
    socklen_t size = sizeof(*from);
    const ssize_t length = recvfrom(descriptor_, bytes.data(), bytes.size(), 0,
                                    reinterpret_cast<sockaddr*>(from), &size);
    return length == 8 && bytes[0] == 0x12 && bytes[1] == 0x34 ? bytes[3] : -1;
  }

  void Send(const RdtDatagram& datagram, const sockaddr_in& to) {
    const auto bytes = datagram.Bytes();
    sendto(descriptor_, bytes.data(), bytes.size(), 0,
           reinterpret_cast<const sockaddr*>(&to), sizeof(to));
  }

 private:
  int descriptor_;
  int port_{0};
};

// Streams a record a millisecond, from 1 on, to who asked last.
class Sensor {
 public:
  Sensor() : thread_([this] { Serve(); }) {}
  ~Sensor() {
    end = true;
    thread_.join();
  }

  int port() const { return socket_.port(); }

  std::atomic<bool> silent{false};
  std::atomic<bool> end{false};
  std::atomic<int> streams{0};
  std::atomic<int> stops{0};
  std::atomic<int> client_port{0};

 private:
  void Serve() {
    bool streaming = false;
    sockaddr_in client{};
    RdtDatagram record{.sequence = 0, .sample = 5000};
    while (!end) {
      const int command = socket_.Receive(&client);
      if (command == 2) {
        streaming = true;
        record.sequence = 0;
        client_port = ntohs(client.sin_port);
        ++streams;
      }
      if (command == 0) {
        streaming = false;
        ++stops;
      }
      ++record.sample;
      if (!streaming || silent) continue;
      ++record.sequence;
      record.counts[2] = 10000000 + static_cast<int>(record.sample % 7);
      socket_.Send(record, client);
    }
  }

  Socket socket_;
  std::thread thread_;
};

// Whether it comes true; the machine may be busy.
bool Await(const std::function<bool()>& condition) {
  for (int i = 0; i < 5000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

RdtSensorParams ParamsFor(int port) {
  RdtSensorParams params;
  params.host = "127.0.0.1";
  params.port = port;
  params.silence = 5;  // On a busy machine a test may have to wait.
  return params;
}

TEST(RdtSensorTest, ReadsFromOpenToClose) {
  Sensor sensor;
  RdtSensor dut(ParamsFor(sensor.port()));
  EXPECT_FALSE(dut.Read().valid);
  EXPECT_NE(dut.fault().find("not open"), std::string::npos);

  const double before = MonotonicTime();
  dut.Open();
  const Reading<Vector6> first = dut.Read();
  EXPECT_TRUE(first.valid);
  EXPECT_GE(first.time, before - 0.001);
  EXPECT_LE(first.time, MonotonicTime());
  EXPECT_NEAR(first.value[2], -10, 1e-4);
  EXPECT_EQ(dut.fault(), "");
  EXPECT_TRUE(Await([&] { return dut.Read().time > first.time; }));
  EXPECT_GE(dut.counts().taken, 2);

  dut.Close();
  EXPECT_FALSE(dut.Read().valid);
  EXPECT_NE(dut.fault().find("not open"), std::string::npos);
  EXPECT_TRUE(Await([&] { return sensor.stops == 1; }));
  dut.Close();

  dut.Open();
  EXPECT_TRUE(dut.Read().valid);
  EXPECT_EQ(sensor.streams, 2);
}

TEST(RdtSensorTest, SilenceIsNotValidAndTheStreamIsAskedForAgain) {
  Sensor sensor;
  RdtSensorParams params = ParamsFor(sensor.port());
  params.silence = 0.1;
  RdtSensor dut(params);
  dut.Open();
  sensor.silent = true;
  ASSERT_TRUE(Await([&] { return !dut.Read().valid; }));
  EXPECT_GT(dut.Read().Age(MonotonicTime()), 0.1);
  EXPECT_NE(dut.fault().find("no record for 0.1 s"), std::string::npos);
  EXPECT_TRUE(Await([&] { return sensor.streams >= 3; }));
  sensor.silent = false;
  EXPECT_TRUE(Await([&] { return dut.Read().valid; }));
  EXPECT_EQ(dut.fault(), "");
}

TEST(RdtSensorTest, OthersAreNotHeard) {
  Sensor sensor;
  RdtSensor dut(ParamsFor(sensor.port()));
  dut.Open();
  Socket other;
  for (std::uint32_t i = 0; i < 100; ++i) {
    other.Send({.sequence = 500 + i, .sample = i, .counts = {99000000}},
               Loopback(sensor.client_port));
  }
  const std::int64_t taken = dut.counts().taken;
  ASSERT_TRUE(Await([&] { return dut.counts().taken > taken + 20; }));
  EXPECT_EQ(dut.Read().value[0], 0);
  EXPECT_EQ(dut.counts().lost, 0);
}

TEST(RdtSensorTest, NobodyThere) {
  int port = 0;
  {
    const Socket gone;
    port = gone.port();
  }
  RdtSensorParams params = ParamsFor(port);
  params.silence = 0.1;
  RdtSensor dut(params);
  std::string text;
  try {
    dut.Open();
  } catch (const DriverError& error) {
    text = error.what();
  }
  EXPECT_NE(text.find("no record for 0.1 s"), std::string::npos) << text;
  EXPECT_NE(text.find("Connection refused"), std::string::npos) << text;
  EXPECT_FALSE(dut.Read().valid);
}

TEST(RdtSensorTest, BadAddresses) {
  RdtSensorParams params;
  params.host = "127.0.0.1";
  params.local_address = "::1";  // Of another kind.
  EXPECT_THROW(RdtSensor(params).Open(), DriverError);
  params.local_address = "203.0.113.1";  // Of nobody.
  EXPECT_THROW(RdtSensor(params).Open(), DriverError);
}

TEST(RdtSensorTest, ClosesSoonWhateverComes) {
  Sensor sensor;
  RdtSensor dut(ParamsFor(sensor.port()));
  dut.Open();
  sensor.silent = true;
  const double before = MonotonicTime();
  dut.Close();
  const double took = MonotonicTime() - before;
  RecordProperty("close_ms", static_cast<int>(1000 * took));
  EXPECT_LT(took, 1);
}

TEST(RdtSensorTest, ReadingDoesNotAllocate) {
  Sensor sensor;
  RdtSensor dut(ParamsFor(sensor.port()));
  dut.Open();
  const ScopedNoAlloc guard;
  double sum = 0;
  for (int i = 0; i < 1000; ++i) sum += dut.Read().value[2];
  EXPECT_EQ(guard.count(), 0);
  EXPECT_LT(sum, 0);
}

}  // namespace
}  // namespace dual_proxy
