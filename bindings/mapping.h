// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "dual_proxy/experiment/scenario.h"
#include "params.h"

/** @file
A scenario from and to a Python mapping (of a YAML file), by the Serialize() of
its structs: what Drake's YAML reader does in C++, with errors that say more. */

namespace dual_proxy {

/** Sets a leaf. `path` starts the message.
@throws ScenarioError for a value of another type or shape, or not finite. */
void ReadLeaf(const py::handle& value, const std::string& path, bool* result);
void ReadLeaf(const py::handle& value, const std::string& path, int* result);
void ReadLeaf(const py::handle& value, const std::string& path,
              std::int64_t* result);
void ReadLeaf(const py::handle& value, const std::string& path, double* result);
void ReadLeaf(const py::handle& value, const std::string& path,
              std::string* result);

/** Sets rows x cols numbers, row by row, from a list or nested lists. */
void ReadNumbers(const py::handle& value, const std::string& path, int rows,
                 int cols, double* result);

template <int kRows, int kCols>
void ReadLeaf(const py::handle& value, const std::string& path,
              Eigen::Matrix<double, kRows, kCols>* result) {
  Eigen::Matrix<double, kRows, kCols,
                kCols == 1 ? Eigen::ColMajor : Eigen::RowMajor>
      numbers;
  ReadNumbers(value, path, kRows, kCols, numbers.data());
  *result = numbers;
}

/** @throws ScenarioError "path: expected a mapping, got ...". */
py::dict AsMapping(const py::handle& value, const std::string& path);
/** @throws ScenarioError "path: expected a list, got ...". */
py::list AsList(const py::handle& value, const std::string& path);

/** Sets the fields of a struct that a mapping names; the rest keep their value.
An archive in the sense of common/serialize.h. */
class MappingReader {
 public:
  /** @param path  dotted path of the struct, for errors.
  @param key  dotted key of the struct from the scenario's top, with a dot at
    its end; empty for the top. */
  MappingReader(py::dict mapping, std::string path, std::string key);

  template <typename T>
  void Visit(const NameValue<T>& field) {
    const char* name = field.name();
    known_.append(name);
    if (mapping_.contains(name)) {
      Read(mapping_[name], path_ + "." + name, key_ + name + ".",
           field.value());
    } else if (field.required() && missing_.empty()) {
      missing_ = name;
    }
  }

  /** Reads a whole struct.
  @throws ScenarioError one line: path, what was expected, what was found. */
  template <typename T>
  static void ReadStruct(py::dict mapping, const std::string& path,
                         const std::string& key, T* result) {
    MappingReader reader(std::move(mapping), path, key);
    if constexpr (std::is_same_v<T, Scenario::Overrides>) {
      // These two are keys, too, though no section has them.
      reader.known_.append("scheme");
      reader.known_.append("law");
    }
    try {
      result->Serialize(&reader);
    } catch (const InvalidField& error) {
      throw ScenarioError(path + "." + error.field() + ": " + error.problem());
    }
    reader.CheckKeys();
  }

 private:
  template <typename T>
  void Read(const py::handle& value, const std::string& path,
            const std::string& key, T* result) {
    if constexpr (std::is_same_v<T, Scenario::Overrides>) {
      // Overrides are the scenario's own keys, and errors name them so.
      ReadStruct(AsOverrides(value, path), path_, "", result);
    } else if constexpr (Serializable<T>) {
      ReadStruct(AsMapping(value, path), path, key, result);
    } else {
      ReadLeaf(value, path, result);
    }
  }

  template <typename T>
  void Read(const py::handle& value, const std::string& path,
            const std::string& key, std::vector<T>* result) {
    const py::list list = AsList(value, path);
    std::vector<T> items(list.size());
    for (std::size_t i = 0; i < items.size(); ++i) {
      Read(list[i], path + "[" + std::to_string(i) + "]", key, &items[i]);
    }
    *result = std::move(items);
  }

  template <typename T>
  void Read(const py::handle& value, const std::string& path,
            const std::string& key, std::optional<T>* result) {
    T item;
    Read(value, path, key, &item);
    *result = item;
  }

  // Of a mapping without the keys that overrides may not have.
  py::dict AsOverrides(const py::handle& value, const std::string& path) const;

  // Throws for a key that was not visited or a required one that is not there.
  void CheckKeys() const;

  py::dict mapping_;
  std::string path_;
  std::string key_;
  py::list known_;
  std::string missing_;
};

/** Makes the mapping that MappingReader reads; arrays become lists, and what is
optional and has no value is left out. */
class MappingWriter {
 public:
  template <typename T>
  void Visit(const NameValue<T>& field) {
    if constexpr (kIsOptional<T>) {
      if (!*field.value()) return;
    }
    mapping_[field.name()] = Write(field.value());
  }

  /** The mapping of a struct, by what `serialize(writer)` visits. */
  template <typename Serialize>
  static py::dict WriteStruct(const Serialize& serialize) {
    MappingWriter writer;
    serialize(&writer);
    return writer.mapping_;
  }

 private:
  template <typename T>
  static py::object Write(T* value) {
    if constexpr (Serializable<T>) {
      return WriteStruct([value](auto* writer) { value->Serialize(writer); });
    } else if constexpr (std::is_base_of_v<Eigen::MatrixBase<T>, T>) {
      return py::cast(*value).attr("tolist")();
    } else {
      return py::cast(*value);
    }
  }

  template <typename T>
  static py::object Write(std::optional<T>* item) {
    return Write(&**item);
  }

  template <typename T>
  static py::object Write(std::vector<T>* items) {
    py::list list;
    for (T& item : *items) list.append(Write(&item));
    return list;
  }

  py::dict mapping_;
};

}  // namespace dual_proxy
