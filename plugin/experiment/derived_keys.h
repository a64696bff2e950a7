// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** A value of a scenario that is a copy of another: dotted keys. */
struct DerivedKey {
  std::string_view key;
  std::string_view source;  ///< What is to be written in its place.
};

/** All of them. Scenario::Distribute() makes the copies; no archive sees them,
so that writing one in YAML is an error. */
std::span<const DerivedKey> DerivedKeys();

/** The source of a derived key, or of what lies below one; empty if the key is
to be written itself. */
std::string_view FindSource(std::string_view key);

/** Passes to an archive what a scenario's author writes: all but the derived
keys. `prefix` is the dotted key of what is visited, with a dot at its end, or
empty for the scenario itself. */
template <typename Archive>
class WrittenArchive {
 public:
  explicit WrittenArchive(Archive* archive, std::string prefix = "")
      : archive_(archive), prefix_(std::move(prefix)) {}

  template <typename T>
  void Visit(const NameValue<T>& field) {
    const std::string key = prefix_ + field.name();
    if (!FindSource(key).empty()) return;
    if constexpr (Serializable<T>) {
      Written<T> written{field.value(), key + "."};
      archive_->Visit(NameValue(field.name(), &written));
    } else {
      archive_->Visit(field);
    }
  }

 private:
  // Stands for a nested struct, to wrap the archive that goes into it, too.
  template <typename T>
  struct Written {
    T* value{};
    std::string prefix;

    template <typename Inner>
    void Serialize(Inner* inner) {
      WrittenArchive<Inner> archive(inner, prefix);
      value->Serialize(&archive);
    }
  };

  Archive* archive_;
  std::string prefix_;
};

}  // namespace dual_proxy
