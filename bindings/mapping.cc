// SPDX-License-Identifier: BSD-3-Clause
#include "mapping.h"

#include <cmath>
#include <utility>

namespace dual_proxy {
namespace {

// A key as it is written, if it is a name, else as Python shows it.
std::string KeyText(const py::handle& key) {
  const bool is_name =
      py::isinstance<py::str>(key) && key.attr("isprintable")().cast<bool>();
  return is_name ? key.cast<std::string>() : Show(key);
}

[[noreturn]] void ThrowExpected(const std::string& path,
                                const std::string& expected,
                                const py::handle& value) {
  const char* found = py::isinstance<py::dict>(value) ? "has no parts, " : "";
  throw ScenarioError(path + ": " + found + "expected " + expected + ", got " +
                      Show(value));
}

template <typename Integer>
void ReadInteger(const py::handle& value, const std::string& path,
                 Integer* result) {
  const auto integer = AsInteger(value);
  if (!integer) ThrowExpected(path, "an integer", value);
  try {
    *result = integer->cast<Integer>();
  } catch (const py::cast_error&) {
    ThrowExpected(
        path, "an integer of " + std::to_string(8 * sizeof(Integer)) + " bits",
        value);
  }
}

// The key as written, with the first of what is below it, and so on, as far as
// keys go; a mapping may contain itself.
std::string FirstLeaf(std::string key, py::handle value) {
  constexpr int kDeepest = 8;
  for (int depth = 0; depth < kDeepest; ++depth) {
    if (!py::isinstance<py::dict>(value) || py::len(value) == 0) break;
    const auto [name, inner] = *value.cast<py::dict>().begin();
    key += "." + KeyText(name);
    value = inner;
  }
  return key;
}

}  // namespace

void ReadLeaf(const py::handle& value, const std::string& path, bool* result) {
  const auto found = AsBool(value);
  if (!found) ThrowExpected(path, "true or false", value);
  *result = *found;
}

void ReadLeaf(const py::handle& value, const std::string& path, int* result) {
  ReadInteger(value, path, result);
}

void ReadLeaf(const py::handle& value, const std::string& path,
              std::int64_t* result) {
  ReadInteger(value, path, result);
}

void ReadLeaf(const py::handle& value, const std::string& path,
              double* result) {
  const auto number = AsNumber(value);
  if (!number) ThrowExpected(path, "a number", value);
  if (!std::isfinite(*number)) ThrowExpected(path, "a finite number", value);
  *result = *number;
}

void ReadLeaf(const py::handle& value, const std::string& path,
              std::string* result) {
  auto text = AsText(value);
  if (!text) ThrowExpected(path, "a string", value);
  *result = *std::move(text);
}

void ReadNumbers(const py::handle& value, const std::string& path, int rows,
                 int cols, double* result) {
  py::object list = py::reinterpret_borrow<py::object>(value);
  if (py::isinstance<py::array>(value)) list = value.attr("tolist")();
  const bool is_list =
      py::isinstance<py::list>(list) || py::isinstance<py::tuple>(list);
  if (!is_list || py::len(list) != static_cast<std::size_t>(rows)) {
    const std::string by = cols == 1 ? "" : " x " + std::to_string(cols);
    ThrowExpected(path, std::to_string(rows) + by + " numbers", value);
  }
  for (int i = 0; i < rows; ++i) {
    const py::object item = list[py::int_(i)];
    const std::string item_path = path + "[" + std::to_string(i) + "]";
    if (cols == 1) {
      ReadLeaf(item, item_path, result + i);
    } else {
      ReadNumbers(item, item_path, cols, 1, result + i * cols);
    }
  }
}

py::dict AsMapping(const py::handle& value, const std::string& path) {
  const py::object mapping =
      py::module_::import("collections.abc").attr("Mapping");
  if (!py::isinstance(value, mapping)) {
    ThrowExpected(path, "a mapping", value);
  }
  return py::dict(py::reinterpret_borrow<py::object>(value));
}

py::list AsList(const py::handle& value, const std::string& path) {
  if (!py::isinstance<py::list>(value) && !py::isinstance<py::tuple>(value)) {
    ThrowExpected(path, "a list", value);
  }
  return py::list(py::reinterpret_borrow<py::object>(value));
}

MappingReader::MappingReader(py::dict mapping, std::string path,
                             std::string key)
    : mapping_(std::move(mapping)),
      path_(std::move(path)),
      key_(std::move(key)) {}

py::dict MappingReader::AsOverrides(const py::handle& value,
                                    const std::string& path) const {
  py::dict overrides = AsMapping(value, path);
  for (const char* name : {"scheme", "law"}) {
    if (overrides.contains(name)) {
      throw ScenarioError(path + "." + name + ": set " + path_ + "." + name +
                          " instead");
    }
  }
  return overrides;
}

void MappingReader::CheckKeys() const {
  for (const auto& [key, value] : mapping_) {
    if (known_.contains(key)) continue;
    const std::string name = KeyText(key);
    const std::string_view source = FindSource(key_ + name);
    if (!source.empty()) {
      // The path without the key of what is read: the scenario's name.
      const std::string top = path_.substr(0, path_.size() - key_.size());
      throw ScenarioError(path_ + "." + FirstLeaf(name, value) +
                          ": is taken from " + top + "." + std::string(source) +
                          ", set that instead");
    }
    const py::list close = py::module_::import("difflib").attr(
        "get_close_matches")(name, known_, 1);
    throw ScenarioError(
        path_ + ": unknown key " + Show(key) +
        (close.empty()
             ? ", expected " +
                   py::str(", ").attr("join")(known_).cast<std::string>()
             : ", did you mean " + Show(close[0]) + "?"));
  }
  if (!missing_.empty()) {
    throw ScenarioError(path_ + ": missing key " + Show(py::str(missing_)));
  }
}

}  // namespace dual_proxy
