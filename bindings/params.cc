// SPDX-License-Identifier: BSD-3-Clause
#include "params.h"

namespace dual_proxy {
namespace {

py::dict FieldNames(const py::object& self) {
  return py::type::of(self).attr("fields");
}

}  // namespace

void ThrowShape(const char* name, const std::string& expected,
                const py::handle& got) {
  throw py::value_error(std::string(name) + ": expected shape " + expected +
                        ", got " +
                        py::str(got.attr("shape")).cast<std::string>());
}

std::string FixedShape(int rows, int cols) {
  return "(" + std::to_string(rows) + "," +
         (cols == 1 ? "" : " " + std::to_string(cols)) + ")";
}

py::array_t<double, py::array::forcecast> AsArray(const py::handle& value,
                                                  const char* name,
                                                  const std::string& expected) {
  auto array = py::array_t<double, py::array::forcecast>::ensure(value);
  if (!array) {
    PyErr_Clear();
    throw py::value_error(std::string(name) + ": expected numbers of shape " +
                          expected + ", got " +
                          py::repr(value).cast<std::string>());
  }
  return array;
}

void SetFields(const py::object& self, const py::dict& values) {
  const py::dict names = FieldNames(self);
  for (const auto& [key, value] : values) {
    if (!names.contains(key)) {
      throw py::type_error(
          py::type::of(self).attr("__name__").cast<std::string>() +
          ": unknown field `" + key.cast<std::string>() +
          "`, expected one of " +
          py::str(", ").attr("join")(names).cast<std::string>());
    }
    py::setattr(self, key, value);
  }
}

std::string FieldsRepr(const py::object& self) {
  std::string text =
      py::type::of(self).attr("__name__").cast<std::string>() + "(";
  bool first = true;
  for (const auto& [name, doc] : FieldNames(self)) {
    py::object value = py::getattr(self, name);
    if (py::isinstance<py::array>(value)) value = value.attr("tolist")();
    text += (first ? "" : ", ") + name.cast<std::string>() + "=" +
            py::repr(value).cast<std::string>();
    first = false;
  }
  return text + ")";
}

py::dict FieldsDict(const py::object& self) {
  py::dict values;
  const py::object deepcopy = py::module_::import("copy").attr("deepcopy");
  for (const auto& [name, doc] : FieldNames(self)) {
    values[name] = deepcopy(py::getattr(self, name));
  }
  return values;
}

bool FieldsEqual(const py::object& self, const py::object& other) {
  if (!py::type::of(self).is(py::type::of(other))) return false;
  for (const auto& [name, doc] : FieldNames(self)) {
    const py::object mine = py::getattr(self, name);
    const py::object theirs = py::getattr(other, name);
    const bool equal =
        py::isinstance<py::array>(mine)
            ? mine.attr("tolist")().equal(theirs.attr("tolist")())
            : mine.equal(theirs);
    if (!equal) return false;
  }
  return true;
}

}  // namespace dual_proxy
