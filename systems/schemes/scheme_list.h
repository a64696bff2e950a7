// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <concepts>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/schemes/half.h"

namespace dual_proxy {

/** A half of one of several schemes, chosen when it is made: a plain value, no
heap and no virtual functions. Each `Half` has a State with an `output` of type
Output, MakeState() and Update(time, input, state). */
template <typename Input, typename Output, typename... Half>
class AnyHalf {
 public:
  /** What the half remembers. */
  class State {
   public:
    State() = default;

    const Output& output() const {
      return std::visit(
          [](const auto& state) -> const Output& { return state.output; },
          state_);
    }

   private:
    friend class AnyHalf;
    std::variant<typename Half::State...> state_;
  };

  template <typename H>
    requires(std::same_as<H, Half> || ...)
  explicit AnyHalf(H half) : half_(std::move(half)) {}

  State MakeState() const {
    State state;
    std::visit([&state](const auto& half) { state.state_ = half.MakeState(); },
               half_);
    return state;
  }

  /** Whether a state was made by a half of the same scheme. */
  bool IsCompatible(const State& state) const noexcept {
    return half_.index() == state.state_.index();
  }

  /** Advances by one period; the results are in state->output().
  @param time s, not decreasing.
  @pre IsCompatible(*state). No heap, no throw. */
  void Update(double time, const Input& input, State* state) const noexcept {
    std::visit(
        [&](const auto& half) {
          using S = typename std::decay_t<decltype(half)>::State;
          half.Update(time, input, std::get_if<S>(&state->state_));
        },
        half_);
  }

 private:
  std::variant<Half...> half_;
};

/** What is made of a list of schemes. Each has a name `kName`, whether it
`kUsesSelections`, whether its robot half `kReclutches`
(RobotSideProxyParams::reclutch), the tags of what it sends kToRobot and
kToDevice, the types Params, RobotHalf and HapticHalf, and a template
ApplyPresets( RobotSideProxyParams*, ControllerParams*), which sets what it
wants to be otherwise than the scenario's defaults, whatever robot's controller
it is. */
template <typename... S>
struct SchemeList {
  static constexpr int kSize = sizeof...(S);
  static constexpr std::array<bool, kSize> kUsesSelections{
      S::kUsesSelections...};
  static constexpr std::array<bool, kSize> kReclutches{S::kReclutches...};
  static constexpr std::array<MessageTag, kSize> kToRobot{S::kToRobot...};
  static constexpr std::array<MessageTag, kSize> kToDevice{S::kToDevice...};

  using RobotHalf =
      AnyHalf<RobotHalfInput, RobotHalfOutput, typename S::RobotHalf...>;
  using HapticHalf =
      AnyHalf<HapticHalfInput, HapticHalfOutput, typename S::HapticHalf...>;

  /** The place of a scheme in the list. */
  template <typename Scheme>
  static constexpr int IndexOf() {
    int index = 0;
    const bool found = ((std::is_same_v<Scheme, S> || (++index, false)) || ...);
    return found ? index : -1;
  }

  /** The names of an enum whose values are the places in the list. */
  template <typename Enum>
  static constexpr std::array<std::pair<Enum, const char*>, kSize>
  MakeEnumStrings() {
    return {std::pair<Enum, const char*>{static_cast<Enum>(IndexOf<S>()),
                                         S::kName}...};
  }

  /** Calls function.template operator()<Scheme>() for each. */
  template <typename Function>
  static void ForEach(const Function& function) {
    (function.template operator()<S>(), ...);
  }

  /** The parameters of all schemes; those that have none are left out of what
  Serialize() visits. */
  class Params {
   public:
    template <typename Scheme>
    typename Scheme::Params& get() {
      return std::get<IndexOf<Scheme>()>(params_);
    }
    template <typename Scheme>
    const typename Scheme::Params& get() const {
      return std::get<IndexOf<Scheme>()>(params_);
    }

    /** @throws std::invalid_argument naming field, range and value. */
    void Validate() const { (get<S>().Validate(), ...); }

    /** Visits the parameters of each scheme by its name. */
    template <typename Archive>
    void Serialize(Archive* a) {
      (Visit<S>(a), ...);
    }

   private:
    template <typename Scheme, typename Archive>
    void Visit(Archive* a) {
      if constexpr (!std::is_same_v<typename Scheme::Params, NoParams>) {
        a->Visit(Field(Scheme::kName, &get<Scheme>(), "of this scheme"));
      }
    }

    std::tuple<typename S::Params...> params_;
  };

  /** @throws std::invalid_argument if a parameter is invalid. */
  static RobotHalf MakeRobotHalf(int scheme, const RobotHalfParams& shared,
                                 const Params& params) {
    return Make<RobotHalf>(scheme, [&]<typename Scheme>() {
      return RobotHalf(
          typename Scheme::RobotHalf(shared, params.template get<Scheme>()));
    });
  }

  /** @throws std::invalid_argument if a parameter is invalid. */
  static HapticHalf MakeHapticHalf(int scheme, const HapticHalfParams& shared,
                                   const Params& params) {
    return Make<HapticHalf>(scheme, [&]<typename Scheme>() {
      return HapticHalf(
          typename Scheme::HapticHalf(shared, params.template get<Scheme>()));
    });
  }

 private:
  template <typename Half, typename Function>
  static Half Make(int scheme, const Function& make) {
    std::optional<Half> half;
    ForEach([&]<typename Scheme>() {
      if (scheme == IndexOf<Scheme>()) {
        half.emplace(make.template operator()<Scheme>());
      }
    });
    if (!half) {
      throw std::invalid_argument(
          "scheme: expected a scheme's place in the list, 0 to " +
          std::to_string(kSize - 1) + ", got " + std::to_string(scheme));
    }
    return *std::move(half);
  }
};

}  // namespace dual_proxy
