// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

#include "from_python.h"

/** @file
How functions are bound that people call: Def() of a module, and def() of a
BoundClass. An argument that is not what it has to be is an error of one line,
which names it, what is expected and what there is; so is one that is missing or
unknown. pybind11's own error is a list of all signatures instead. */

namespace dual_proxy {

/** An argument that nobody has looked at; in signatures it is a T. */
template <typename T>
struct Given {
  py::handle value;
};

}  // namespace dual_proxy

template <typename T>
struct pybind11::detail::type_caster<dual_proxy::Given<T>> {
  PYBIND11_TYPE_CASTER(dual_proxy::Given<T>, make_caster<T>::name);
  bool load(handle source, bool) {
    value = {source};
    return true;
  }
};

namespace dual_proxy {

/** The name of an argument, and whether it has to be there. */
struct ArgumentName {
  const char* name;
  bool required;
};

/** Tells what is wrong with the names or the number of a call's arguments.
@throws TypeError, always. */
[[noreturn]] void ThrowArguments(const char* function,
                                 const std::vector<ArgumentName>& names,
                                 const py::args& args,
                                 const py::kwargs& kwargs);

/** What is left of `const T&`, `T&` and `T*`. */
template <typename T>
using Bare =
    std::remove_cv_t<std::remove_pointer_t<std::remove_reference_t<T>>>;

/** A class that Python knows. */
template <typename T>
inline constexpr bool kIsBound =
    std::is_base_of_v<py::detail::type_caster_base<T>,
                      py::detail::make_caster<T>>;

/** What can be checked: numbers, strings, bytes, objects of classes that Python
knows, and these or None. */
template <typename T>
inline constexpr bool kIsChecked =
    std::is_arithmetic_v<T> || std::is_same_v<T, std::string> ||
    std::is_same_v<T, py::bytes> || kIsBound<T>;
template <typename T>
inline constexpr bool kIsChecked<std::optional<T>> = kIsChecked<T>;

/** @throws TypeError naming the argument unless `value` is a T. */
template <typename T>
T& ObjectFromPython(const py::handle& value, const char* name) {
  if (!py::isinstance<T>(value)) {
    ThrowExpected<py::type_error>(
        "", name,
        py::type::of<T>().attr("__name__").template cast<std::string>(), value);
  }
  return value.cast<T&>();
}

/** The argument of type T that is there, with its name for errors. */
template <typename T>
decltype(auto) Check(const Given<Bare<T>>& given, const char* name) {
  if constexpr (!kIsBound<Bare<T>>) {
    return FieldFromPython<Bare<T>>(given.value, name, "");
  } else if constexpr (std::is_pointer_v<std::remove_reference_t<T>>) {
    return &ObjectFromPython<Bare<T>>(given.value, name);
  } else {
    return (ObjectFromPython<Bare<T>>(given.value, name));
  }
}
/** One that is checked elsewhere. */
template <typename T>
T&& Check(std::remove_reference_t<T>& value, const char*) {
  return static_cast<T&&>(value);
}

/** How an argument of type T is taken. */
template <typename T, bool is_named>
using Taken =
    std::conditional_t<is_named && kIsChecked<Bare<T>>, Given<Bare<T>>, T>;

/** Whether there is nothing that such an argument could not be taken from. */
template <typename T>
inline constexpr bool kTakesAny =
    std::is_same_v<std::remove_cvref_t<T>, py::object> ||
    std::is_same_v<std::remove_cvref_t<T>, py::kwargs>;
template <typename T>
inline constexpr bool kTakesAny<Given<T>> = true;

template <typename T>
inline constexpr bool kIsArgument = std::is_base_of_v<py::arg, T>;
template <typename T>
inline constexpr bool kReleasesLock = false;
template <typename... T>
inline constexpr bool kReleasesLock<py::call_guard<T...>> = true;

/** The names among what def() is given, in order. */
template <typename... Extra>
std::vector<ArgumentName> ArgumentNames(const Extra&... extra) {
  std::vector<ArgumentName> names;
  const auto add = [&names]<typename T>(const T& item) {
    if constexpr (kIsArgument<T>) {
      names.push_back({item.name, !std::is_same_v<T, py::arg_v>});
    }
  };
  (add(extra), ...);
  return names;
}

/** The documentation among what def() is given. */
template <typename... Extra>
std::string TextAmong(const Extra&... extra) {
  std::string text;
  const auto add = [&text]<typename T>(const T& item) {
    if constexpr (std::is_convertible_v<const T&, const char*>) text = item;
  };
  (add(extra), ...);
  return text;
}
template <typename T>
decltype(auto) WithoutText(const T& item) {
  if constexpr (std::is_convertible_v<const T&, const char*>) {
    return "";
  } else {
    return (item);
  }
}

/** A function that is to be bound: its last `kNames` arguments are checked. */
template <std::size_t kNames, typename F, typename R, typename... Args>
class CheckedFunction {
 public:
  static constexpr std::size_t kUnnamed = sizeof...(Args) - kNames;

  template <std::size_t... kIndex>
  static auto Make(F function, const std::array<const char*, kNames + 1>& names,
                   std::index_sequence<kIndex...>) {
    return [function = std::move(function),
            names](Taken<Args, (kIndex >= kUnnamed)>... given) -> R {
      // In braces they are checked in their order.
      return std::apply(
          function,
          std::tuple<decltype(Check<Args>(given, ""))...>{Check<Args>(
              given,
              names[kIndex < kUnnamed ? kNames : kIndex - kUnnamed])...});
    };
  }

  template <std::size_t... kIndex>
  static constexpr bool TakesAny(std::index_sequence<kIndex...>) {
    return (
        (kIndex < kUnnamed || kTakesAny<Taken<Args, (kIndex >= kUnnamed)>>) &&
        ...);
  }
};

/** Whether people call it so: `copy`, not `__copy__`, but also `__init__`. */
bool IsCalledByName(std::string_view function);

/** Binds a function and, if it stands alone under its name, what tells of
arguments that it does not take.
@param define  binds, as def() of pybind11's classes and modules does.
@param refuse  makes what is bound as the second overload. */
template <bool kAlone = true, typename R, typename... Args, typename F,
          typename Define, typename Refuse, typename... Extra>
void DefChecked(R (* /* signature */)(Args...), F function,
                const py::object& owner, const char* name, const Define& define,
                const Refuse& refuse, const Extra&... extra) {
  static_assert((!kReleasesLock<Extra> && ...),
                "arguments are checked with the interpreter's lock: release it "
                "in the function");
  constexpr std::size_t kNames = (std::size_t{0} + ... + kIsArgument<Extra>);
  constexpr std::size_t kArgs = sizeof...(Args);
  static_assert(kNames <= kArgs);
  using Checked = CheckedFunction<kNames, F, R, Args...>;
  constexpr auto kIndices = std::make_index_sequence<kArgs>();
  const std::vector<ArgumentName> names = ArgumentNames(extra...);
  std::array<const char*, kNames + 1> texts{};
  for (std::size_t i = 0; i < kNames; ++i) texts[i] = names[i].name;
  const auto checked = Checked::Make(std::move(function), texts, kIndices);
  if constexpr (!kAlone || !Checked::TakesAny(kIndices)) {
    define(checked, extra...);
  } else if (!IsCalledByName(name)) {
    define(checked, extra...);
  } else {
    // The documentation of both is the first one's.
    define(checked, WithoutText(extra)...);
    auto text = owner.attr(name).attr("__doc__").template cast<std::string>();
    const std::string meaning = TextAmong(extra...);
    if (!meaning.empty()) text += "\n" + meaning + "\n";
    py::options options;
    options.disable_function_signatures();
    define(refuse(names), text.c_str());
  }
}

/** A function's signature without the class that it is of. */
template <typename F>
using SignatureOf = py::detail::function_signature_t<F>*;

/** Binds a function of a module. */
template <typename F, typename... Extra>
void Def(py::module_* m, const char* name, F function, const Extra&... extra) {
  DefChecked(
      SignatureOf<F>(), std::move(function), *m, name,
      [m, name](const auto&... all) { m->def(name, all...); },
      [name](const std::vector<ArgumentName>& names) {
        return [name, names](const py::args& args, const py::kwargs& kwargs) {
          ThrowArguments(name, names, args, kwargs);
        };
      },
      extra...);
}

/** pybind11's class, whose functions and constructors check their arguments. */
template <typename T, typename... Options>
class BoundClass : public py::class_<T, Options...> {
 public:
  using Base = py::class_<T, Options...>;
  using Base::Base;

  /** A function whose first argument is the object. */
  template <typename F, typename... Extra>
    requires(!std::is_member_function_pointer_v<F>)
  BoundClass& def(const char* name, F function, const Extra&... extra) {
    DefChecked(
        SignatureOf<F>(), std::move(function), *this, name,
        [this, name](const auto&... all) { Base::def(name, all...); },
        [name](const std::vector<ArgumentName>& names) {
          return [name, names](const T&, const py::args& args,
                               const py::kwargs& kwargs) {
            ThrowArguments(name, names, args, kwargs);
          };
        },
        extra...);
    return *this;
  }

  /** A member function. */
  template <typename R, typename C, typename... Args, typename... Extra>
  BoundClass& def(const char* name, R (C::*function)(Args...) const,
                  const Extra&... extra) {
    return def(
        name,
        [function](const T& self, Args... args) -> R {
          return (self.*function)(std::forward<Args>(args)...);
        },
        extra...);
  }
  template <typename R, typename C, typename... Args, typename... Extra>
  BoundClass& def(const char* name, R (C::*function)(Args...) const noexcept,
                  const Extra&... extra) {
    return def(name, static_cast<R (C::*)(Args...) const>(function), extra...);
  }

  template <typename R, typename C, typename... Args, typename... Extra>
  BoundClass& def(const char* name, R (C::*function)(Args...) noexcept,
                  const Extra&... extra) {
    return def(name, static_cast<R (C::*)(Args...)>(function), extra...);
  }
  template <typename R, typename C, typename... Args, typename... Extra>
  BoundClass& def(const char* name, R (C::*function)(Args...),
                  const Extra&... extra) {
    return def(
        name,
        [function](T& self, Args... args) -> R {
          return (self.*function)(std::forward<Args>(args)...);
        },
        extra...);
  }

  /** The constructor T(Args...). */
  template <typename... Args, typename... Extra>
  BoundClass& def_constructor(const Extra&... extra) {
    return def_factory(
        [](Args... args) { return new T(std::forward<Args>(args)...); },
        extra...);
  }

  /** A function that makes a T, as the constructor. */
  template <typename F, typename... Extra>
  BoundClass& def_factory(F function, const Extra&... extra) {
    return DefFactory<true>(std::move(function), extra...);
  }

  /** One of several, which the names and the number of arguments tell apart. */
  template <typename F, typename... Extra>
  BoundClass& def_one_factory(F function, const Extra&... extra) {
    return DefFactory<false>(std::move(function), extra...);
  }

  template <typename Get, typename Set>
  BoundClass& def_pickle(const Get& get, const Set& set) {
    Base::def(py::pickle(get, set));
    return *this;
  }

  /** A function of the class. */
  template <typename F, typename... Extra>
  BoundClass& def_static(const char* name, F function, const Extra&... extra) {
    DefChecked(
        SignatureOf<F>(), std::move(function), *this, name,
        [this, name](const auto&... all) { Base::def_static(name, all...); },
        [name](const std::vector<ArgumentName>& names) {
          return [name, names](const py::args& args, const py::kwargs& kwargs) {
            ThrowArguments(name, names, args, kwargs);
          };
        },
        extra...);
    return *this;
  }

  /** A property; `set` takes the object and what is checked. */
  template <typename Get, typename Set, typename... Extra>
  BoundClass& def_property(const char* name, const Get& get, const Set& set,
                           const Extra&... extra) {
    Base::def_property(name, get, CheckedSetter(SignatureOf<Set>(), set, name),
                       extra...);
    return *this;
  }

  template <typename Value>
  BoundClass& def_readwrite(const char* name, Value T::* member,
                            const char* doc) {
    return def_property(
        name, [member](T& self) -> Value& { return self.*member; },
        [member](T& self, const Value& value) { self.*member = value; },
        py::return_value_policy::reference_internal, doc);
  }

  template <typename Get, typename... Extra>
  BoundClass& def_property_readonly(const char* name, const Get& get,
                                    const Extra&... extra) {
    Base::def_property_readonly(name, get, extra...);
    return *this;
  }

  template <typename... Extra>
  BoundClass& def_readonly(const char* name, const Extra&... extra) {
    Base::def_readonly(name, extra...);
    return *this;
  }

 private:
  template <bool kAlone, typename F, typename... Extra>
  BoundClass& DefFactory(F function, const Extra&... extra) {
    const auto define = [this](const auto& f, const auto&... all) {
      Base::def(py::init(f), all...);
    };
    const auto refuse = [this](const std::vector<ArgumentName>& names) {
      return [who = this->attr("__name__").template cast<std::string>(), names](
                 const py::args& args, const py::kwargs& kwargs) -> T* {
        ThrowArguments(who.c_str(), names, args, kwargs);
      };
    };
    DefChecked<kAlone>(SignatureOf<F>(), std::move(function), *this, "__init__",
                       define, refuse, extra...);
    return *this;
  }

  template <typename R, typename... Args, typename Set>
  static auto CheckedSetter(R (*)(Args...), const Set& set, const char* name) {
    return CheckedFunction<1, Set, R, Args...>::Make(
        set, {name, nullptr}, std::index_sequence_for<Args...>());
  }
};

}  // namespace dual_proxy
