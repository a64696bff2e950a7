// SPDX-License-Identifier: BSD-3-Clause

// What an update of the force-space particle filter takes with each likelihood,
// beside the textbook's (textbook_filter.h: the paper's), per number of
// particles and per instruction set. Counters of each case, us per update:
// mean, median, p99, max; and, as the machine's speed drifts: `yardsticks`, the
// median over that of a fixed loop which takes turns with the updates, and
// `textbook`, how many times as many the textbook takes. Run it by
// benchmarks/filter_speed.py.

#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "dual_proxy/common/random.h"
#include "dual_proxy/perception/force_space_particle_filter.h"
#include "textbook_filter.h"
#include "timing.h"

namespace dual_proxy {
namespace {

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
    // As before, and as many particles again are added by the paper's.
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
  std::size_t next = 0;
  return MeasureCalls(
      situation.batch, [] {}, [&] { update(inputs[next++ % kNumInputs]); },
      state);
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
               int num_particles, Likelihood likelihood,
               InstructionSet instruction_set) {
  ForceSpaceParticleFilterParams params;
  params.num_particles = num_particles;
  params.likelihood = likelihood;
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
  for (const auto& [likelihood, name] : EnumStrings<Likelihood>::kValues) {
    for (const InstructionSet set : AvailableInstructionSets()) {
      if (num_particles != 1000 && set != FastestInstructionSet()) continue;
      benchmark::RegisterBenchmark(
          (std::string(name) + " " + EnumToString(set) + "/" + where).c_str(),
          RunFilter, situation, num_particles, likelihood, set)
          ->UseManualTime()
          ->Unit(benchmark::kMicrosecond);
    }
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
