// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

/** @file
How a struct of settings tells its fields, once, to whoever reads, writes,
checks, binds or documents them. It has one template,

    template <typename Archive>
    void Serialize(Archive* a) {
      a->Visit(Field("rate", &rate, Above(0), "Hz", "of messages"));
      a->Visit(Field("map", &map, "between device and robot"));
      VisitEnum(a, "FooParams", "shape", &shape, "of the workspace");
    }

which works with every archive that has a Visit() for a NameValue: Drake's YAML
reader (LoadYamlFile), the Python bindings' reader and writer of mappings, their
classes, ValidateFields(), and a few small ones that only want the names or the
nested structs. Leaves are bool, integers, double, std::string, fixed-size Eigen
vectors and matrices, std::optionals of those (nothing: not written), and
std::vectors of structs. */

template <typename T>
inline constexpr bool kIsOptional = false;
template <typename T>
inline constexpr bool kIsOptional<std::optional<T>> = true;

/** A field's name and where it is. What Drake's archives take. */
template <typename T>
class NameValue {
 public:
  using value_type = T;

  NameValue(const char* name, T* value) : name_(name), value_(value) {}

  const char* name() const { return name_; }
  T* value() const { return value_; }
  /** Whether an item of a list must give it. A reader that is told to keep
  defaults (Drake's) does not ask. */
  bool required() const { return required_; }

 protected:
  bool required_{false};

 private:
  const char* name_;
  T* value_;
};

/** What is to be said of a field. */
struct FieldNotes {
  std::optional<Range> range{};  ///< None for what has no numbers.
  const char* unit{""};
  const char* meaning{""};
};

/** A field with all that is to be said of it. */
template <typename T>
class FieldValue : public NameValue<T> {
 public:
  FieldValue(const char* name, T* value, const FieldNotes& notes)
      : NameValue<T>(name, value), notes_(notes) {}

  const FieldNotes& notes() const { return notes_; }

  FieldValue& Required() {
    this->required_ = true;
    return *this;
  }

 private:
  FieldNotes notes_;
};

/** A number, or an array whose entries are all in the range. */
template <typename T>
FieldValue<T> Field(const char* name, T* value, const Range& range,
                    const char* unit, const char* meaning) {
  return {name, value, {range, unit, meaning}};
}

/** A bool, a string, a struct with fields of its own, or a list of those. */
template <typename T>
FieldValue<T> Field(const char* name, T* value, const char* meaning) {
  return {name, value, {.meaning = meaning}};
}

/** Visits an enum by the name of its value (EnumStrings); an archive that has a
VisitEnumField() gets the enum itself.
@param required  see NameValue::required().
@throws InvalidField if the archive sets a name that is none. */
template <typename Archive, typename Enum>
void VisitEnum(Archive* a, const char* who, const char* name, Enum* value,
               const char* meaning, bool required = false) {
  if constexpr (requires { a->VisitEnumField(name, value, meaning); }) {
    a->VisitEnumField(name, value, meaning);
  } else {
    std::string string = EnumToString(*value);
    FieldValue<std::string> field = Field(name, &string, meaning);
    if (required) field.Required();
    a->Visit(field);
    const std::optional<Enum> found = EnumFromString<Enum>(string);
    if (!found) {
      throw InvalidField(
          who, name,
          "expected " + ExpectedEnum<Enum>() + ", got \"" + string + "\"");
    }
    *value = *found;
  }
}

/** Visits the fields of a struct as if they were those of the struct that holds
it; an archive that has a VisitEmbeddedField() gets the struct itself. */
template <typename Archive, typename T>
void VisitEmbedded(Archive* a, const char* name, T* value,
                   const char* meaning) {
  if constexpr (requires { a->VisitEmbeddedField(name, value, meaning); }) {
    a->VisitEmbeddedField(name, value, meaning);
  } else {
    value->Serialize(a);
  }
}

/** Checks what a struct's Serialize() visits: numbers by their ranges, structs
by their own Validate(). */
class FieldChecker {
 public:
  explicit FieldChecker(const char* who) : who_(who) {}

  template <typename T>
  void Visit(const FieldValue<T>& field) const {
    const T& value = *field.value();
    const std::optional<Range>& range = field.notes().range;
    if constexpr (requires { value.Validate(); }) {
      value.Validate();
    } else if constexpr (requires { value.begin()->Validate(); }) {
      for (const auto& item : value) item.Validate();
    } else if constexpr (kIsOptional<T>) {
      if (value && range) ThrowUnlessIn(who_, field.name(), *value, *range);
    } else if constexpr (requires { ThrowUnlessIn("", "", value, Range()); }) {
      if (range) ThrowUnlessIn(who_, field.name(), value, *range);
    }
  }

  template <typename Enum>
  void VisitEnumField(const char* name, const Enum* value,
                      const char* /* meaning */) const {
    if (EnumFromString<Enum>(EnumToString(*value))) return;
    ThrowInvalidField(who_, name, ExpectedEnum<Enum>().c_str(),
                      static_cast<int>(*value));
  }

  template <typename T>
  void VisitEmbeddedField(const char* /* name */, const T* value,
                          const char* /* meaning */) const {
    value->Validate();
  }

 private:
  const char* who_;
};

/** @throws std::invalid_argument naming field, range and value. */
template <typename Params>
void ValidateFields(const char* who, const Params& params) {
  Params copy = params;
  FieldChecker checker(who);
  copy.Serialize(&checker);
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
