// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <Eigen/Core>

#include "arguments.h"
#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"
#include "from_python.h"

/** @file
One way to bind the plain `...Params` and `...State` structs. */

namespace dual_proxy {

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

/** A field's type as Drake's yaml_load_typed() wants it: float, int, bool, str
(for enums, too), numpy.ndarray, a Params class, Optional[...] of one, or
list[...]. */
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
  } else if constexpr (kIsOptional<T>) {
    return py::module_::import("typing").attr(
        "Optional")[FieldType<typename T::value_type>()];
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

/** A class of parameters. */
template <typename T>
inline constexpr bool kIsStruct =
    std::is_class_v<T> && !kIsMatrix<T> && !kIsVector<T> && !kIsOptional<T> &&
    !std::is_same_v<T, std::string>;

/** "FooParams", "list of FooParams"; nothing for what is neither. */
template <typename T>
std::string StructText() {
  if constexpr (kIsStruct<T>) {
    return py::type::of<T>().attr("__name__").template cast<std::string>();
  } else if constexpr (kIsVector<T>) {
    return "list of " + StructText<typename T::value_type>();
  } else {
    return "";
  }
}

/** "500", "[0, 1, 0]", "true", "printed"; nothing for what takes more than a
line. */
template <typename T>
std::string DefaultText(const T& value) {
  std::ostringstream text;
  text << std::boolalpha;
  if constexpr (std::is_enum_v<T>) {
    text << '"' << EnumToString(value) << '"';
  } else if constexpr (kIsMatrix<T>) {
    if ((value.array() == value(0)).all()) {
      text << value(0);
    } else if (value.isIdentity(0)) {
      text << "identity";
    } else {
      text << value.transpose().format({Eigen::StreamPrecision,
                                        Eigen::DontAlignCols, ", ", "", "", "",
                                        "[", "]"});
    }
  } else if constexpr (std::is_arithmetic_v<T>) {
    text << value;
  }
  return text.str();
}

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
and pickle. `__fields__` (of each field name, type, unit, range, default and
meaning) is the schema for Drake's yaml_load_typed() and yaml_dump_typed(), and
what docs/reference.md is made of. */
template <typename Params>
class BindParams {
 public:
  using Class = BoundClass<Params, std::unique_ptr<Params, ParamsDeleter>>;

  /** @param checked whether the constructor validates what it is given. */
  BindParams(py::module_& m, const char* name, const char* doc,
             bool checked = true)
      : class_(m, name, doc) {
    class_.attr("fields") = py::dict();
    class_.attr("__fields__") = py::list();
    class_
        .def_factory(
            [checked](const py::kwargs& kwargs) {
              Params params;
              // A view of the stack object: only for setting its fields.
              const py::object self =
                  py::cast(&params, py::return_value_policy::reference);
              SetFields(self, kwargs);
              // Defaults alone need not be valid: what reads a file fills
              // them.
              if (checked && !kwargs.empty()) params.Validate();
              return params;
            },
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
        .def_pickle([](const py::object& self) { return FieldsDict(self); },
                    [](const py::dict& values) {
                      Params params;
                      const py::object self =
                          py::cast(&params, py::return_value_policy::reference);
                      SetFields(self, values);
                      return params;
                    });
    class_.attr("__hash__") = py::none();
  }

  /** Binds every field that Serialize() visits, with what it says of it. */
  BindParams& Fields() {
    return Fields([](Params* params, auto* a) { params->Serialize(a); });
  }

  /** Binds every field that `visit(&params, archive)` visits. */
  template <typename Visit>
  BindParams& Fields(const Visit& visit) {
    Params prototype;
    FieldBinder binder{.owner = this, .prototype = &prototype};
    visit(&prototype, &binder);
    return *this;
  }

  template <typename T>
  BindParams& Field(const char* name, T Params::* member, const char* doc) {
    AppendSchema(name, FieldType<T>(), {.meaning = doc});
    return Attribute<T>(
        name, [member](Params& self) -> T& { return self.*member; }, doc);
  }

  /** A field with an array of a shape of its own: `get(params)` returns a
  read-only array, `set(&params, value)` checks the value's shape. */
  template <typename Get, typename Set>
  BindParams& ArrayField(const char* name, const Get& get, const Set& set,
                         const char* doc) {
    AppendSchema(name, FieldType<Eigen::VectorXd>(), {.meaning = doc});
    class_.attr("fields")[name] = doc;
    Property(name, get, set, doc);
    return *this;
  }

  Class& py_class() { return class_; }

 private:
  // What documentation shows of a field.
  struct Texts {
    std::string unit{};
    std::string range{};
    std::string value{};
    std::string meaning{};

    // "N/m, >= 0: k_vir_r, default 500".
    std::string Doc(const std::string& shape) const {
      std::string doc;
      for (const std::string& part : {shape, unit, range}) {
        if (!part.empty()) doc += (doc.empty() ? "" : ", ") + part;
      }
      doc += (doc.empty() ? "" : ": ") + meaning;
      return doc + (value.empty() ? "" : ", default " + value);
    }
  };

  // An archive. A field is where it is in the prototype.
  struct FieldBinder {
    template <typename T>
    void Visit(const FieldValue<T>& field) {
      const auto& [range, unit, meaning] = field.notes();
      Bind(field.name(), field.value(),
           {.unit = unit,
            .range = range ? RangeText(*range) : StructText<T>(),
            .value = DefaultText(*field.value()),
            .meaning = meaning});
    }

    template <typename Enum>
    void VisitEnumField(const char* name, Enum* value, const char* meaning) {
      Bind(name, value,
           {.range = ExpectedEnum<Enum>(),
            .value = DefaultText(*value),
            .meaning = meaning});
    }

    // The struct is an attribute, and so are its fields, which alone are keys.
    template <typename T>
    void VisitEmbeddedField(const char* name, T* value, const char* meaning) {
      const Texts texts{.range = StructText<T>(), .meaning = meaning};
      owner->template Attribute<T>(name, Access(value), texts.Doc("").c_str());
      embedded = true;
      value->Serialize(this);
      embedded = false;
    }

    template <typename T>
    void Bind(const char* name, T* value, const Texts& texts) {
      std::string shape;
      if constexpr (kIsMatrix<T>) {
        shape = FixedShape(T::RowsAtCompileTime, T::ColsAtCompileTime);
      } else if constexpr (kIsOptionalMatrix<T>) {
        shape = FixedShape(T::value_type::RowsAtCompileTime,
                           T::value_type::ColsAtCompileTime);
      }
      owner->AppendSchema(name, FieldType<T>(), texts);
      owner->template Attribute<T>(name, Access(value),
                                   texts.Doc(shape).c_str(), !embedded);
    }

    template <typename T>
    auto Access(T* value) const {
      const std::ptrdiff_t offset =
          reinterpret_cast<char*>(value) - reinterpret_cast<char*>(prototype);
      return [offset](Params& self) -> T& {
        return *reinterpret_cast<T*>(reinterpret_cast<char*>(&self) + offset);
      };
    }

    BindParams* owner{};
    Params* prototype{};
    bool embedded{false};
  };

  void AppendSchema(const char* name, const py::object& type,
                    const Texts& texts) {
    using py::literals::operator""_a;
    class_.attr("__fields__")
        .attr("append")(py::module_::import("types").attr("SimpleNamespace")(
            "name"_a = name, "type"_a = type, "unit"_a = texts.unit,
            "range"_a = texts.range, "default"_a = texts.value,
            "meaning"_a = texts.meaning));
  }

  // `access(params)` is the field.
  template <typename T, typename Access>
  BindParams& Attribute(const char* name, const Access& access, const char* doc,
                        bool is_field = true) {
    const auto set = [access, name](Params* self, const py::object& value) {
      access(*self) = FieldFromPython<T>(value, name);
    };
    const auto get = [access](Params& self) {
      if constexpr (std::is_enum_v<T>) {
        return EnumToString(access(self));
      } else if constexpr (kIsMatrix<T>) {
        return ReadOnly(py::array_t<double>(py::cast(T(access(self)))));
      } else if constexpr (kIsVector<T>) {
        return AsTuple(access(self));
      } else if constexpr (kIsOptionalMatrix<T>) {
        using Array = py::array_t<double>;
        const T& value = access(self);
        return value ? std::optional(ReadOnly(Array(py::cast(*value))))
                     : std::nullopt;
      } else {
        return T(access(self));
      }
    };
    if (is_field) class_.attr("fields")[name] = doc;
    if constexpr (kIsStruct<T>) {
      Property(name, access, set, doc,
               py::return_value_policy::reference_internal);
    } else {
      Property(name, get, set, doc);
    }
    return *this;
  }

  template <typename Get, typename Set, typename... Extra>
  void Property(const char* name, const Get& get, const Set& set,
                const char* doc, const Extra&... extra) {
    class_.def_property(
        name, get,
        [set, name](Params& self, const py::object& value) {
          CheckWritable(&self, py::type::of<Params>(), name);
          set(&self, value);
        },
        extra..., doc);
  }

  Class class_;
};

/** Binds a `...State` struct as a copyable value (`copy`, `deepcopy`). It is
made by its algorithm's `make_state()`, never by hand. */
template <typename State>
BoundClass<State> BindState(py::module_& m, const char* name, const char* doc) {
  return BoundClass<State>(m, name, doc)
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
