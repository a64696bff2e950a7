// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/omega/force_dimension_sdk.h"

#include <dlfcn.h>
#include <sys/utsname.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include "dual_proxy/drivers/driver.h"

namespace dual_proxy {
namespace {

namespace fs = std::filesystem;

constexpr const char* kVariable = "FDSDK";
constexpr const char* kWhereToGetIt =
    "The SDK is had from https://www.forcedimension.com (software, Force "
    "Dimension SDK); say where it is by `library` or by the environment "
    "variable FDSDK, its folder or the file libdrd.so.*.";

// The numbers in a name: {3, 17, 5} of libdrd.so.3.17.5.
std::vector<int> NumbersIn(const std::string& name) {
  std::vector<int> numbers;
  bool inside = false;
  for (const char c : name) {
    const bool is_digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
    if (is_digit && !inside) numbers.push_back(0);
    if (is_digit) numbers.back() = (numbers.back() % 100000) * 10 + (c - '0');
    inside = is_digit;
  }
  return numbers;
}

// The libraries of this name in a folder, newest version first.
std::vector<std::string> FindIn(const fs::path& folder, const char* name) {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().filename().string().starts_with(name)) {
      found.push_back(entry.path());
    }
  }
  std::sort(found.begin(), found.end(),
            [](const std::string& a, const std::string& b) {
              return NumbersIn(fs::path(a).filename()) >
                     NumbersIn(fs::path(b).filename());
            });
  return found;
}

// As the SDK's folder has them: lib/release/lin-x86_64-gcc.
fs::path LibraryFolder(const fs::path& sdk) {
  utsname system{};
  uname(&system);
  return sdk / "lib" / "release" /
         ("lin-" + std::string(system.machine) + "-gcc");
}

// What a path that a user gave may mean.
std::vector<std::string> Given(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return {path};
  std::vector<std::string> found = FindIn(LibraryFolder(path), "libdrd.so");
  const std::vector<std::string> directly = FindIn(path, "libdrd.so");
  found.insert(found.end(), directly.begin(), directly.end());
  if (found.empty()) found = {LibraryFolder(path) / "libdrd.so"};
  return found;
}

std::vector<std::string> Usual() {
  std::vector<fs::path> folders{"/usr/local/lib"};
  if (const char* home = std::getenv("HOME")) {
    folders.push_back(fs::path(home) / ".local" / "lib");
  }
  std::vector<std::string> candidates;
  for (const char* name : {"libdrd.so", "libdhd.so"}) {
    candidates.emplace_back(name);
    for (const fs::path& folder : folders) {
      const std::vector<std::string> found = FindIn(folder, name);
      candidates.insert(candidates.end(), found.begin(), found.end());
    }
  }
  return candidates;
}

std::vector<std::string> Candidates(const std::string& library) {
  if (!library.empty()) return Given(library);
  const char* const variable = std::getenv(kVariable);
  if (variable != nullptr && variable[0] != '\0') return Given(variable);
  return Usual();
}

// Appends an item to a list.
void Append(const char* separator, const std::string& item, std::string* list) {
  if (!list->empty()) *list += separator;
  *list += item;
}

}  // namespace

ForceDimensionSdk LoadForceDimensionSdk(const std::string& library) {
  std::string tried;
  for (const std::string& candidate : Candidates(library)) {
    Append("; ", candidate, &tried);
    void* const handle = dlopen(candidate.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) {
      const char* const reason = dlerror();
      Append(": ", reason != nullptr ? reason : "cannot be loaded", &tried);
      continue;
    }
    ForceDimensionSdk sdk;
    sdk.path = candidate;
    std::string missing;
#define DUAL_PROXY_RESOLVE(result, name, arguments)                       \
  sdk.name = reinterpret_cast<result(*) arguments>(dlsym(handle, #name)); \
  if (sdk.name == nullptr) Append(", ", #name, &missing);
    DUAL_PROXY_FORCE_DIMENSION_FUNCTIONS(DUAL_PROXY_RESOLVE)
#undef DUAL_PROXY_RESOLVE
    if (!missing.empty()) {
      dlclose(handle);
      tried += ": has no " + missing + ", which libdrd of a newer SDK has";
      continue;
    }
    int version[4]{};
    sdk.dhdGetSDKVersion(&version[0], &version[1], &version[2], &version[3]);
    for (const int number : version) {
      Append(".", std::to_string(number), &sdk.version);
    }
    return sdk;
  }
  throw DriverError("Force Dimension's SDK was not found. Tried: " + tried +
                    ". " + kWhereToGetIt);
}

}  // namespace dual_proxy
