// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <numeric>
#include <vector>

namespace dual_proxy {

/** About 5 us of multiplications and additions, each waiting for the last. */
inline double Yardstick(double x) {
  for (int i = 0; i < 2000; ++i) x = x * 0.999 + 0.001;
  return x;
}

/** Seconds that `run` takes. */
template <typename Run>
double Time(const Run& run) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  run();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/** Times calls of `update()`, `batch` at once, and sets the counters: us per
call (mean, median, p99, max) and, as a machine's speed drifts, the median in
`yardsticks`, which take turns with the calls. `prepare()` goes before each
batch and is not timed.
@returns the yardsticks. */
template <typename Prepare, typename Update>
double MeasureCalls(int batch, const Prepare& prepare, const Update& update,
                    benchmark::State* state) {
  std::vector<double> times;
  std::vector<double> yardsticks;
  double x = 0.5;
  while (state->KeepRunning()) {
    prepare();
    const double seconds = Time([&] {
      for (int i = 0; i < batch; ++i) update();
    });
    state->SetIterationTime(seconds);
    times.push_back(1e6 * seconds / batch);
    yardsticks.push_back(
        1e6 * Time([&x] { benchmark::DoNotOptimize(x = Yardstick(x)); }));
  }
  std::sort(times.begin(), times.end());
  std::sort(yardsticks.begin(), yardsticks.end());
  const auto count = static_cast<double>(times.size());
  const double median = times[times.size() / 2];
  const double cost = median / yardsticks[times.size() / 2];
  state->counters["mean_us"] =
      std::accumulate(times.begin(), times.end(), 0.0) / count;
  state->counters["median_us"] = median;
  state->counters["p99_us"] =
      times[static_cast<std::size_t>(0.99 * (count - 1))];
  state->counters["max_us"] = times.back();
  state->counters["yardsticks"] = cost;
  return cost;
}

}  // namespace dual_proxy
