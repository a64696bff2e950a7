// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

/** @file
How a struct of settings tells its fields to whoever reads or writes them. It
has one template,

    template <typename Archive>
    void Serialize(Archive* a) {
      a->Visit(MakeNameValue("rate", &rate));
      VisitEnum(a, "FooParams", "shape", &shape);
    }

which works with every archive that has a Visit() for such pairs: Drake's YAML
reader (LoadYamlFile), the Python bindings' reader and writer of mappings, and
a few small ones that only want the names or the nested structs. Leaves are
bool, int, std::int64_t, double, std::string, fixed-size Eigen vectors and
matrices, and std::vectors of structs. */

/** A field's name and where it is. What Drake's archives take. */
template <typename T>
class NameValue {
 public:
  using value_type = T;

  NameValue(const char* name, T* value, bool required = false)
      : name_(name), value_(value), required_(required) {}

  const char* name() const { return name_; }
  T* value() const { return value_; }
  /** Whether an item of a list must give it. A reader that is told to keep
  defaults (Drake's) does not ask. */
  bool required() const { return required_; }

 private:
  const char* name_;
  T* value_;
  bool required_;
};

template <typename T>
NameValue<T> MakeNameValue(const char* name, T* value) {
  return NameValue<T>(name, value);
}

template <typename T>
NameValue<T> MakeRequired(const char* name, T* value) {
  return NameValue<T>(name, value, true);
}

/** Visits an enum by the name of its value (EnumStrings).
@throws InvalidField if the archive sets a name that is none. */
template <typename Archive, typename Enum>
void VisitEnum(Archive* a, const char* who, const char* name, Enum* value) {
  std::string string = EnumToString(*value);
  a->Visit(MakeNameValue(name, &string));
  const std::optional<Enum> found = EnumFromString<Enum>(string);
  if (!found) {
    throw InvalidField(
        who, name,
        "expected " + ExpectedEnum<Enum>() + ", got \"" + string + "\"");
  }
  *value = *found;
}

/** Takes any field; for the concept below. */
struct AnyArchive {
  template <typename T>
  void Visit(const NameValue<T>&) {}
};

/** Has a Serialize() of its own. */
template <typename T>
concept Serializable =
    requires(T value, AnyArchive* archive) { value.Serialize(archive); };

}  // namespace dual_proxy
