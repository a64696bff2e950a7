// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"

/** @file
What every file of bindings/ shares: arrays whose shape is checked with an error
that names the argument, enums as lower-case strings, and one way to bind the
plain `...Params` and `...State` structs. */

namespace dual_proxy {

namespace py = pybind11;

/** "name: expected float64 of shape (3,), got shape (2,)" as ValueError. */
[[noreturn]] void ThrowShape(const char* name, const std::string& expected,
                             const py::handle& got);

/** An array of doubles made from any Python value, or a ValueError that names
it. */
py::array_t<double, py::array::forcecast> AsArray(const py::handle& value,
                                                  const char* name,
                                                  const std::string& expected);

/** "(3,)" or "(3, 3)". */
std::string FixedShape(int rows, int cols);

/** Fixed-size vector or matrix from an array-like of exactly that shape.
@throws ValueError naming `name`, the expected and the received shape. */
template <typename Matrix>
Matrix AsFixed(const py::handle& value, const char* name) {
  constexpr int kRows = Matrix::RowsAtCompileTime;
  constexpr int kCols = Matrix::ColsAtCompileTime;
  static_assert(kRows != Eigen::Dynamic && kCols != Eigen::Dynamic);
  constexpr int kDims = kCols == 1 ? 1 : 2;
  using Array = py::array_t<double, py::array::forcecast>;
  // What a control loop passes is an array of doubles already.
  const Array array = py::isinstance<py::array_t<double>>(value)
                          ? py::reinterpret_borrow<Array>(value)
                          : AsArray(value, name, FixedShape(kRows, kCols));
  if (array.ndim() != kDims || array.shape(0) != kRows ||
      (kDims == 2 && array.shape(1) != kCols)) {
    ThrowShape(name, FixedShape(kRows, kCols), array);
  }
  Matrix result;
  if constexpr (kDims == 1) {
    const auto view = array.template unchecked<1>();
    for (int i = 0; i < kRows; ++i) result(i) = view(i);
  } else {
    const auto view = array.template unchecked<2>();
    for (int i = 0; i < kRows; ++i) {
      for (int j = 0; j < kCols; ++j) result(i, j) = view(i, j);
    }
  }
  return result;
}

inline Eigen::Vector3d Vec3(const py::handle& value, const char* name) {
  return AsFixed<Eigen::Vector3d>(value, name);
}

inline Eigen::Matrix3d Mat3(const py::handle& value, const char* name) {
  return AsFixed<Eigen::Matrix3d>(value, name);
}

/** An enum's value by its name in Python (EnumStrings).
@throws ValueError that names the field and lists what is allowed. */
template <typename Enum>
Enum EnumFromPython(const py::handle& value, const char* name) {
  if (py::isinstance<py::str>(value)) {
    const auto found = EnumFromString<Enum>(value.cast<std::string>());
    if (found) return *found;
  }
  throw py::value_error("field `" + std::string(name) + "` expected " +
                        ExpectedEnum<Enum>() + ", got " +
                        py::repr(value).cast<std::string>());
}

/** The names of an enum's values, in order. */
template <typename Enum>
py::tuple EnumNames() {
  py::list names;
  for (const auto& [value, name] : EnumStrings<Enum>::kValues) {
    names.append(name);
  }
  return py::tuple(names);
}

template <typename T>
inline constexpr bool kIsVector = false;
template <typename T>
inline constexpr bool kIsVector<std::vector<T>> = true;

/** Copies of structs, as a tuple. */
template <typename T>
py::tuple AsTuple(const std::vector<T>& items) {
  py::list copies;
  for (const T& item : items) copies.append(item);
  return py::tuple(copies);
}

/** A field's value from Python: a number, a string, an enum's name, an array of
the exact shape, nested Params, or a list of them.
@throws TypeError or ValueError naming the field. */
template <typename T>
T FieldFromPython(const py::handle& value, const char* name) {
  if constexpr (std::is_enum_v<T>) {
    return EnumFromPython<T>(value, name);
  } else if constexpr (std::is_base_of_v<Eigen::MatrixBase<T>, T>) {
    return AsFixed<T>(value, name);
  } else if constexpr (kIsVector<T>) {
    if (!py::isinstance<py::list>(value) && !py::isinstance<py::tuple>(value)) {
      throw py::type_error("field `" + std::string(name) +
                           "` expected a list, got " +
                           py::repr(value).cast<std::string>());
    }
    T items;
    for (const py::handle& item : value) {
      items.push_back(FieldFromPython<typename T::value_type>(item, name));
    }
    return items;
  } else {
    std::string expected;
    if constexpr (std::is_same_v<T, bool>) {
      expected = "true or false";
    } else if constexpr (std::is_integral_v<T>) {
      expected = "an integer";
    } else if constexpr (std::is_floating_point_v<T>) {
      expected = "a number";
    } else if constexpr (std::is_same_v<T, std::string>) {
      expected = "a string";
    } else {
      expected =
          py::type::of<T>().attr("__name__").template cast<std::string>();
    }
    try {
      // Python's True is the integer 1; here it is neither number nor integer.
      if (std::is_arithmetic_v<T> &&
          py::isinstance<py::bool_>(value) != std::is_same_v<T, bool>) {
        throw py::cast_error();
      }
      // Nor are bytes a string.
      if (std::is_same_v<T, std::string> && !py::isinstance<py::str>(value)) {
        throw py::cast_error();
      }
      return value.cast<T>();
    } catch (const py::cast_error&) {
      throw py::type_error("field `" + std::string(name) + "` expected " +
                           expected + ", got " +
                           py::repr(value).cast<std::string>());
    }
  }
}

/** Sets attributes from keyword arguments. @throws TypeError for a key that is
no field. */
void SetFields(const py::object& self, const py::dict& values);
/** "FooParams(delay=0.0, ...)". */
std::string FieldsRepr(const py::object& self);
/** All fields as a dict, in declaration order. */
py::dict FieldsDict(const py::object& self);
/** Field by field, arrays element by element. */
bool FieldsEqual(const py::object& self, const py::object& other);

/** Collects the names that a Serialize() visits. */
struct NamesArchive {
  template <typename T>
  void Visit(const NameValue<T>& field) {
    names.append(field.name());
  }

  py::list names;
};

/** Binds a `...Params` struct: keyword constructor, read and write attributes
(arrays are copies marked read-only, so that writing to an element is an error
and not silently lost; lists are tuples of copies, to be changed by assigning
the whole), `fields` (name -> doc), `validate()`, repr, equality, copy, deepcopy
and pickle. `_serialized_names` are what Serialize() visits, if there is one; a
test holds them to `fields`. */
template <typename Params>
class BindParams {
 public:
  /** @param checked whether the constructor validates. */
  BindParams(py::module_& m, const char* name, const char* doc,
             bool checked = true)
      : class_(m, name, doc) {
    class_.attr("fields") = py::dict();
    if constexpr (Serializable<Params>) {
      NamesArchive archive;
      Params().Serialize(&archive);
      class_.attr("_serialized_names") = py::tuple(archive.names);
    }
    class_
        .def(py::init([checked](const py::kwargs& kwargs) {
               Params params;
               // A view of the stack object: only for setting its fields.
               const py::object self =
                   py::cast(&params, py::return_value_policy::reference);
               SetFields(self, kwargs);
               if (checked) params.Validate();
               return params;
             }),
             "Keyword arguments are the fields; the rest have their defaults.\n"
             "Raises TypeError for an unknown field, ValueError for a value "
             "out of range.")
        .def("validate", &Params::Validate,
             "Raises ValueError naming the field, the range and the value.")
        .def("__repr__", &FieldsRepr)
        .def("__eq__", &FieldsEqual)
        .def("__copy__", [](const Params& self) { return Params(self); })
        .def(
            "__deepcopy__",
            [](const Params& self, const py::dict&) { return Params(self); },
            py::arg("memo"))
        .def(py::pickle([](const py::object& self) { return FieldsDict(self); },
                        [](const py::dict& values) {
                          Params params;
                          const py::object self = py::cast(
                              &params, py::return_value_policy::reference);
                          SetFields(self, values);
                          return params;
                        }));
    class_.attr("__hash__") = py::none();
  }

  template <typename T>
  BindParams& Field(const char* name, T Params::* member, const char* doc) {
    class_.attr("fields")[name] = doc;
    const auto set = [member, name](Params& self, const py::object& value) {
      self.*member = FieldFromPython<T>(value, name);
    };
    if constexpr (std::is_enum_v<T>) {
      class_.def_property(
          name,
          [member](const Params& self) { return EnumToString(self.*member); },
          set, doc);
    } else if constexpr (std::is_base_of_v<Eigen::MatrixBase<T>, T>) {
      class_.def_property(
          name,
          [member](const Params& self) {
            const py::object array = py::cast(T(self.*member));
            array.attr("flags").attr("writeable") = false;
            return py::array_t<double>(array);
          },
          set, doc);
    } else if constexpr (kIsVector<T>) {
      class_.def_property(
          name, [member](const Params& self) { return AsTuple(self.*member); },
          set, doc);
    } else if constexpr (std::is_arithmetic_v<T> ||
                         std::is_same_v<T, std::string>) {
      class_.def_property(
          name, [member](const Params& self) { return self.*member; }, set,
          doc);
    } else {
      class_.def_property(
          name, [member](Params& self) -> T& { return self.*member; }, set,
          py::return_value_policy::reference_internal, doc);
    }
    return *this;
  }

  py::class_<Params>& py_class() { return class_; }

 private:
  py::class_<Params> class_;
};

/** Binds a `...State` struct as a copyable value (`copy`, `deepcopy`). It is
made by its algorithm's `make_state()`, never by hand. */
template <typename State>
py::class_<State> BindState(py::module_& m, const char* name, const char* doc) {
  return py::class_<State>(m, name, doc)
      .def("__copy__", [](const State& self) { return State(self); })
      .def(
          "__deepcopy__",
          [](const State& self, const py::dict&) { return State(self); },
          py::arg("memo"));
}

}  // namespace dual_proxy
