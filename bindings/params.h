// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
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
What every file of bindings/ shares: numbers and arrays of Python and NumPy,
checked with an error that names the argument, enums as lower-case strings, and
one way to bind the plain `...Params` and `...State` structs. */

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

/** A number of Python or NumPy, also as an array without dimensions; infinite
if beyond what a double holds. No bool is one, though Python's True is the
integer 1. */
std::optional<double> AsNumber(const py::handle& value);

/** Likewise, an integer: Python's int. */
std::optional<py::int_> AsInteger(const py::handle& value);

/** A bool of Python or NumPy, also as an array without dimensions. */
std::optional<bool> AsBool(const py::handle& value);

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

template <typename T>
inline constexpr bool kIsMatrix = std::is_base_of_v<Eigen::MatrixBase<T>, T>;

// What is read from parameters, but for nested ones, is a copy. Such a copy is
// read-only, so that a change of it is an error and not silently lost.

/** An array that cannot be written to. */
template <typename Array>
Array ReadOnly(Array array) {
  array.attr("flags").attr("writeable") = false;
  return array;
}

/** Makes `size` bytes at `begin`, an object that Python owns, read-only for
Python until ForgetReadOnly(). */
void MarkReadOnly(const void* begin, std::size_t size);
void ForgetReadOnly(const void* begin);
/** @throws AttributeError naming type and field if `params` is read-only. */
void CheckWritable(const void* params, const py::handle& type,
                   const char* field);

/** A Params object whose fields, and those of the Params in it, cannot be set;
copies of it can be changed again. Elsewhere it is what `Params` is. */
template <typename Params>
class ReadOnlyCopy : public py::object {
 public:
  explicit ReadOnlyCopy(const Params& params)
      : py::object(py::cast(params, py::return_value_policy::copy)) {
    MarkReadOnly(this->template cast<Params*>(), sizeof(Params));
  }
};

/** An algorithm's `params` for Python. */
template <typename Algorithm>
auto ParamsOf(const Algorithm& self) {
  return ReadOnlyCopy(self.params());
}

/** Copies of structs or arrays, as a tuple; read-only. */
template <typename T>
py::tuple AsTuple(const std::vector<T>& items) {
  py::list copies;
  for (const T& item : items) {
    if constexpr (kIsMatrix<T>) {
      copies.append(ReadOnly(py::array_t<double>(py::cast(item))));
    } else {
      copies.append(ReadOnlyCopy<T>(item));
    }
  }
  return py::tuple(copies);
}

/** A field's value from Python: a number, a string, an enum's name, an array of
the exact shape, nested Params, or a list of them.
@throws TypeError or ValueError naming the field. */
template <typename T>
T FieldFromPython(const py::handle& value, const char* name) {
  if constexpr (std::is_enum_v<T>) {
    return EnumFromPython<T>(value, name);
  } else if constexpr (kIsMatrix<T>) {
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
      if (const auto found = AsBool(value)) return *found;
      expected = "true or false";
    } else if constexpr (std::is_integral_v<T>) {
      if (const auto found = AsInteger(value)) {
        try {
          return found->cast<T>();
        } catch (const py::cast_error&) {  // Out of range.
        }
      }
      expected = "an integer";
    } else if constexpr (std::is_floating_point_v<T>) {
      if (const auto found = AsNumber(value)) return *found;
      expected = "a number";
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (py::isinstance<py::str>(value)) return value.cast<T>();
      expected = "a string";
    } else {
      if (py::isinstance<T>(value)) return value.cast<T>();
      expected =
          py::type::of<T>().attr("__name__").template cast<std::string>();
    }
    throw py::type_error("field `" + std::string(name) + "` expected " +
                         expected + ", got " +
                         py::repr(value).cast<std::string>());
  }
}

/** A field's type as Drake's yaml_load_typed() wants it: float, int, bool, str
(for enums, too), numpy.ndarray, a Params class, or list[...] of one. */
template <typename T>
py::object FieldType() {
  const auto builtin = [](PyTypeObject& type) {
    return py::reinterpret_borrow<py::object>(
        reinterpret_cast<PyObject*>(&type));
  };
  if constexpr (std::is_same_v<T, bool>) {
    return builtin(PyBool_Type);
  } else if constexpr (std::is_integral_v<T>) {
    return builtin(PyLong_Type);
  } else if constexpr (std::is_floating_point_v<T>) {
    return builtin(PyFloat_Type);
  } else if constexpr (std::is_enum_v<T> || std::is_same_v<T, std::string>) {
    return builtin(PyUnicode_Type);
  } else if constexpr (kIsMatrix<T>) {
    return py::module_::import("numpy").attr("ndarray");
  } else if constexpr (kIsVector<T>) {
    return builtin(PyList_Type)
        .attr("__class_getitem__")(FieldType<typename T::value_type>());
  } else {
    return py::type::of<T>();
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

/** Deletes a Params object that Python owns. */
struct ParamsDeleter {
  template <typename Params>
  void operator()(Params* params) const {
    ForgetReadOnly(params);
    delete params;
  }
};

/** Binds a `...Params` struct: keyword constructor, read and write attributes
(arrays, and lists as tuples, are read-only copies, to be changed by assigning
the whole), `fields` (name -> doc), `validate()`, repr, equality, copy, deepcopy
and pickle. `__fields__` (name and type of each) is the schema for Drake's
yaml_load_typed() and yaml_dump_typed(). `_serialized_names` are what
Serialize() visits, if there is one; a test holds them to `__fields__`. */
template <typename Params>
class BindParams {
 public:
  using Class = py::class_<Params, std::unique_ptr<Params, ParamsDeleter>>;

  /** @param checked whether the constructor validates what it is given. */
  BindParams(py::module_& m, const char* name, const char* doc,
             bool checked = true)
      : class_(m, name, doc) {
    class_.attr("fields") = py::dict();
    class_.attr("__fields__") = py::list();
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
               // Defaults alone need not be valid: what reads a file fills
               // them.
               if (checked && !kwargs.empty()) params.Validate();
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
    AppendSchema(name, FieldType<T>());
    return Attribute(name, member, doc);
  }

  /** A field that holds Params whose keys stand directly in this struct's: they
  are attributes of this one, too. */
  template <typename T>
  BindParams& EmbeddedField(const char* name, T Params::* member,
                            const char* doc) {
    for (const py::handle& field : py::type::of<T>().attr("__fields__")) {
      const auto key = field.attr("name").template cast<std::string>();
      AppendSchema(key.c_str(), field.attr("type"));
      const std::string part = name;
      class_.def_property(
          key.c_str(),
          [part, key](const py::object& self) {
            return py::object(self.attr(part.c_str()).attr(key.c_str()));
          },
          [part, key](const py::object& self, const py::object& value) {
            self.attr(part.c_str()).attr(key.c_str()) = value;
          },
          py::type::of<T>()
              .attr("fields")[key.c_str()]
              .template cast<std::string>()
              .c_str());
    }
    return Attribute(name, member, doc);
  }

  /** A field with an array of a shape of its own: `get(params)` returns a
  read-only array, `set(&params, value)` checks the value's shape. */
  template <typename Get, typename Set>
  BindParams& ArrayField(const char* name, const Get& get, const Set& set,
                         const char* doc) {
    AppendSchema(name, FieldType<Eigen::VectorXd>());
    return Property(name, get, set, doc);
  }

  Class& py_class() { return class_; }

 private:
  void AppendSchema(const char* name, const py::object& type) {
    using py::literals::operator""_a;
    class_.attr("__fields__")
        .attr("append")(py::module_::import("types").attr("SimpleNamespace")(
            "name"_a = name, "type"_a = type));
  }

  template <typename T>
  BindParams& Attribute(const char* name, T Params::* member, const char* doc) {
    const auto set = [member, name](Params* self, const py::object& value) {
      self->*member = FieldFromPython<T>(value, name);
    };
    if constexpr (std::is_enum_v<T>) {
      return Property(
          name,
          [member](const Params& self) { return EnumToString(self.*member); },
          set, doc);
    } else if constexpr (kIsMatrix<T>) {
      return Property(
          name,
          [member](const Params& self) {
            return ReadOnly(py::array_t<double>(py::cast(T(self.*member))));
          },
          set, doc);
    } else if constexpr (kIsVector<T>) {
      return Property(
          name, [member](const Params& self) { return AsTuple(self.*member); },
          set, doc);
    } else if constexpr (std::is_arithmetic_v<T> ||
                         std::is_same_v<T, std::string>) {
      return Property(
          name, [member](const Params& self) { return self.*member; }, set,
          doc);
    } else {
      return Property(
          name, [member](Params& self) -> T& { return self.*member; }, set, doc,
          py::return_value_policy::reference_internal);
    }
  }

  template <typename Get, typename Set, typename... Extra>
  BindParams& Property(const char* name, const Get& get, const Set& set,
                       const char* doc, const Extra&... extra) {
    class_.attr("fields")[name] = doc;
    class_.def_property(
        name, get,
        [set, name](Params& self, const py::object& value) {
          CheckWritable(&self, py::type::of<Params>(), name);
          set(&self, value);
        },
        extra..., doc);
    return *this;
  }

  Class class_;
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

// In signatures, what it is.
template <typename Params>
struct pybind11::detail::handle_type_name<dual_proxy::ReadOnlyCopy<Params>> {
  static constexpr auto name = make_caster<Params>::name;
};
