// SPDX-License-Identifier: BSD-3-Clause
// Any datagrams as those of a force sensor: what is valid is finite and in its
// range, time does not go back, and a fault says why there is nothing valid.
#include <array>
#include <cmath>
#include <cstdint>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/drivers/ft_sensor/rdt_record.h"
#include "dual_proxy/drivers/ft_sensor/rdt_stream.h"
#include "fuzz_tools.h"

namespace dual_proxy {
namespace {

RdtSensorParams TakeParams(FuzzInput* input) {
  RdtSensorParams params;
  const int kind = input->Byte();
  params.force_unit = static_cast<ForceUnit>(kind % 6);
  params.torque_unit = static_cast<TorqueUnit>(kind / 6 % 6);
  const double counts = std::abs(input->Number());
  if (std::isfinite(counts) && counts > 0) {
    params.counts_per_force = params.counts_per_torque = counts;
  }
  return params;
}

void Check(const RdtSensorParams& params, const RdtStream& stream,
           double last_time) {
  const Reading<Vector6>& reading = stream.reading();
  Require(reading.value.allFinite(), "what is read is finite");
  Require(IsWithin(reading.value.head<3>(), params.max_force) &&
              IsWithin(reading.value.tail<3>(), params.max_moment),
          "what is read is in its range");
  Require(reading.time >= last_time, "time does not go back");
  Require(reading.valid == (stream.fault() == RdtFault::kNone),
          "a fault where nothing is valid");
  const RdtCounts& counts = stream.counts();
  Require(counts.lost >= 0 && counts.faulty >= 0 &&
              counts.faulty <= counts.taken &&
              counts.lost <= counts.taken * RdtSequence::kLongestJump,
          "counts of what was taken");
  Require(!DescribeRdtStatus(stream.status()).empty(), "a status has a text");
}

void Run(FuzzInput* input) {
  const RdtSensorParams params = TakeParams(input);
  RdtStream stream(params);
  double now = 0;
  // A real record to change, so that sequences and not only noise are tried.
  std::array<std::uint8_t, 64> datagram{};
  while (!input->empty()) {
    const int what = input->Byte();
    if (what < 8) {
      stream.NoteRequest();
    } else if (what < 160) {
      for (int i = 0; i < 1 + what % 8; ++i) {
        datagram[input->Index(36)] = static_cast<std::uint8_t>(input->Byte());
      }
    } else {
      ++datagram[3];
      ++datagram[7];
    }
    const int length = input->Byte();
    const std::size_t size = length < 16 ? 4 * length : kRdtRecordSize;
    const double step = input->Number();
    if (std::isfinite(step)) now += step;
    const double last_time = stream.reading().time;
    stream.Take(std::span(datagram).first(size), now);
    Check(params, stream, last_time);
  }
}

}  // namespace
}  // namespace dual_proxy

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  dual_proxy::FuzzInput input(data, size);
  dual_proxy::Run(&input);
  return 0;
}
