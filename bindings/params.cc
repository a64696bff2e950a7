// SPDX-License-Identifier: BSD-3-Clause
#include "params.h"

#include <cstddef>
#include <functional>
#include <iterator>
#include <map>

namespace dual_proxy {
namespace {

// Read-only blocks of memory, begin -> end; one that Python no longer owns is
// not among them. Whoever gets here holds the interpreter's lock.
using Blocks = std::map<const void*, const void*, std::less<>>;

Blocks& ReadOnlyBlocks() {
  static auto& blocks = *new Blocks();  // Python may outlive what is static.
  return blocks;
}

py::dict FieldNames(const py::object& self) {
  return py::type::of(self).attr("fields");
}

}  // namespace

void MarkReadOnly(const void* begin, std::size_t size) {
  ReadOnlyBlocks()[begin] = static_cast<const std::byte*>(begin) + size;
}

void ForgetReadOnly(const void* begin) { ReadOnlyBlocks().erase(begin); }

void CheckWritable(const void* params, const py::handle& type,
                   const char* field) {
  const auto after = ReadOnlyBlocks().upper_bound(params);
  if (after == ReadOnlyBlocks().begin()) return;
  if (!std::less<>()(params, std::prev(after)->second)) return;
  throw py::attribute_error(
      type.attr("__name__").cast<std::string>() + ": field `" + field +
      "` cannot be set, this is a copy of what is in use: change a copy.copy() "
      "of it and assign that, in a list the whole list");
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

namespace {

// Arrays as lists, which compare as a whole.
py::object WithoutArrays(const py::object& value) {
  if (py::isinstance<py::array>(value)) return value.attr("tolist")();
  if (!py::isinstance<py::tuple>(value)) return value;
  py::list items;
  for (const py::handle item : value) {
    items.append(WithoutArrays(py::reinterpret_borrow<py::object>(item)));
  }
  return items;
}

}  // namespace

bool FieldsEqual(const py::object& self, const py::object& other) {
  if (!py::type::of(self).is(py::type::of(other))) return false;
  for (const auto& [name, doc] : FieldNames(self)) {
    const py::object mine = py::getattr(self, name);
    const py::object theirs = py::getattr(other, name);
    if (!WithoutArrays(mine).equal(WithoutArrays(theirs))) return false;
  }
  return true;
}

}  // namespace dual_proxy
