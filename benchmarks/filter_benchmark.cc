// SPDX-License-Identifier: BSD-3-Clause

// What an update of the force-space particle filter takes, beside the
// textbook's (textbook_filter.h), per number of particles and per instruction
// set. Counters of each case, us per update: mean, median, p99, max; and, as
// the machine's speed drifts: `yardsticks`, the median over that of a fixed
// loop which takes turns with the updates, and `textbook`, how many times as
// many the textbook takes. Run it by benchmarks/filter_speed.py.

#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "dual_proxy/common/random.h"
#include "dual_proxy/perception/force_space_particle_filter.h"
#include "textbook_filter.h"

namespace dual_proxy {
namespace {

using Clock = std::chrono::steady_clock;
using Eigen::Vector3d;

struct Inputs {
  Vector3d force, velocity, motion, contact;
};

/** A situation: the inputs without noise; whether it begins with a contact in
the force's direction; and how many updates are timed at once, so that the clock
does not count. */
struct Case {
  const char* name;
  Inputs inputs;
  bool is_contact;
  int batch;
};

const Case kCases[] = {
    // Nothing is touched, and all particles are at the centre.
    {"free", {{0, 0, 0}, {0.05, 0, 0}, {2, 0, 0}, {0, 0, 0}}, false, 100},
    // Pressing and sliding with friction: all particles are on the sphere.
    {"sliding", {{1.5, 0, -8}, {0.05, 0, 0}, {1, 0, 0}, {0, 0, -8}}, true, 1},
    // As before, and as many particles again are added.
    {"worst", {{0, 15, -15}, {0.05, 0, 0}, {0, 12, 0}, {0, 0, -15}}, true, 1},
};

constexpr std::size_t kNumInputs = 256;

/** The inputs with noise: no two updates in a row are the same. */
std::vector<Inputs> MakeInputs(const Inputs& mean) {
  RandomStream random(1);
  std::vector<Inputs> result(kNumInputs, mean);
  for (Inputs& inputs : result) {
    for (double& value : inputs.force) value += 0.1 * random.Normal();
    for (double& value : inputs.velocity) value += 1e-4 * random.Normal();
  }
  return result;
}

/** About 5 us of multiplications and additions, each waiting for the last. */
double Yardstick(double x) {
  for (int i = 0; i < 2000; ++i) x = x * 0.999 + 0.001;
  return x;
}

/** Seconds that `run` takes. */
template <typename Run>
double Time(const Run& run) {
  const Clock::time_point begin = Clock::now();
  run();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/** Median of the textbook's updates in yardsticks, by case and particles. */
std::map<std::pair<std::string, int>, double>& TextbookCosts() {
  static std::map<std::pair<std::string, int>, double> costs;
  return costs;
}

/** Times `update(inputs)` and sets the counters; returns the yardsticks. */
template <typename Update>
double Measure(const Case& situation, const Update& update,
               benchmark::State* state) {
  const std::vector<Inputs> inputs = MakeInputs(situation.inputs);
  Inputs landing = situation.inputs;
  if (situation.is_contact) {
    landing.velocity.setZero();
    landing.motion = landing.force;
  }
  for (int i = 0; i < 10; ++i) update(landing);
  for (std::size_t i = 0; i < 10; ++i) update(inputs[i]);
  std::vector<double> times;
  std::vector<double> yardsticks;
  double x = 0.5;
  std::size_t next = 0;
  while (state->KeepRunning()) {
    const double seconds = Time([&] {
      for (int i = 0; i < situation.batch; ++i) {
        update(inputs[next++ % kNumInputs]);
      }
    });
    state->SetIterationTime(seconds);
    times.push_back(1e6 * seconds / situation.batch);
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

void RunTextbook(benchmark::State& state, const Case& situation,
                 int num_particles) {
  ForceSpaceParticleFilterParams params;
  params.num_particles = num_particles;
  TextbookFilter filter(params);
  TextbookCosts()[{situation.name, num_particles}] = Measure(
      situation,
      [&filter](const Inputs& x) {
        filter.Update(x.force, x.velocity, x.motion, x.contact);
      },
      &state);
}

void RunFilter(benchmark::State& state, const Case& situation,
               int num_particles, InstructionSet instruction_set) {
  ForceSpaceParticleFilterParams params;
  params.num_particles = num_particles;
  params.likelihood = Likelihood::kPaper;  // Which the textbook's is.
  const ForceSpaceParticleFilter filter(params, instruction_set);
  ForceSpaceParticleFilterState memory = filter.MakeState(1);
  const double cost = Measure(
      situation,
      [&](const Inputs& x) {
        filter.Update(x.force, x.velocity, x.motion, x.contact, &memory);
      },
      &state);
  const auto textbook = TextbookCosts().find({situation.name, num_particles});
  if (textbook != TextbookCosts().end()) {
    state.counters["textbook"] = textbook->second / cost;
  }
}

void Register(const Case& situation, int num_particles) {
  const std::string where =
      std::string(situation.name) + "/" + std::to_string(num_particles);
  benchmark::RegisterBenchmark(("textbook/" + where).c_str(), RunTextbook,
                               situation, num_particles)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
  for (const InstructionSet set : AvailableInstructionSets()) {
    if (num_particles != 1000 && set != FastestInstructionSet()) continue;
    benchmark::RegisterBenchmark(
        (std::string(EnumToString(set)) + "/" + where).c_str(), RunFilter,
        situation, num_particles, set)
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
  }
}

}  // namespace
}  // namespace dual_proxy

int main(int argc, char** argv) {
  for (const auto& situation : dual_proxy::kCases) {
    for (const int num_particles : {100, 1000, 10000, 100000}) {
      dual_proxy::Register(situation, num_particles);
    }
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::AddCustomContext("compiler", __VERSION__);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
