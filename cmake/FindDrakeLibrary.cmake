# Finds Drake for C++ as the target drake::drake, in this order:
#
# 1. an installed Drake, by find_package(drake CONFIG);
# 2. the library in the pydrake wheel of the Python environment (which
#    FindPipPackages finds), together with the headers of the same version in
#    DRAKE_INCLUDE_DIR, the folder that has drake/systems/... below it: the wheel
#    has no headers. Where that variable is empty, the environment variable of
#    the same name counts.
#
# Sets
#   DUAL_PROXY_DRAKE          a line that says what was found, or false;
#   DUAL_PROXY_DRAKE_VERSION  its version;
#   DUAL_PROXY_NO_DRAKE       if not found, a line: what is missing, how to get it;
#   DUAL_PROXY_BAD_DRAKE      true if something was given that cannot be used.

set(DRAKE_INCLUDE_DIR "" CACHE PATH
    "Drake's headers, of the version of the pydrake wheel")
# Remembered: a build that configures itself again may run without it.
if(NOT "$ENV{DRAKE_INCLUDE_DIR}" STREQUAL "")
  set(DUAL_PROXY_ENV_DRAKE_INCLUDE_DIR "$ENV{DRAKE_INCLUDE_DIR}" CACHE INTERNAL "")
endif()

# dual_proxy_first_word(file result) sets `result` to the first word of the file,
# which is the version in Drake's VERSION.TXT.
function(dual_proxy_first_word file result)
  file(STRINGS ${file} line LIMIT_COUNT 1)
  string(REGEX MATCH "^[^ ]*" word "${line}")
  set(${result} "${word}" PARENT_SCOPE)
endfunction()

# dual_proxy_drake_header_version(dir result) sets `result` to the version of the
# headers in dir/drake, as far as the folder tells: X.Y.Z, X.Y or nothing.
function(dual_proxy_drake_header_version dir result)
  set(${result} "" PARENT_SCOPE)
  foreach(file ${dir}/../share/doc/drake/VERSION.TXT ${dir}/drake/VERSION.TXT
               ${dir}/VERSION.TXT)
    if(EXISTS ${file})
      dual_proxy_first_word(${file} version)
      set(${result} "${version}" PARENT_SCOPE)
      return()
    endif()
  endforeach()
  # Between two tags this is X.Y.Z-<commits since>-<commit>, no release's version.
  if(EXISTS ${dir}/drake/.git)
    execute_process(
      COMMAND git -C ${dir}/drake describe --tags --match "v*"
      OUTPUT_VARIABLE tag OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(tag MATCHES "^v(.+)$")
      set(${result} "${CMAKE_MATCH_1}" PARENT_SCOPE)
      return()
    endif()
  endif()
  # A source tree without its history tells its version only in its newest notes.
  file(GLOB notes RELATIVE ${dir}/drake/doc/_release-notes
       ${dir}/drake/doc/_release-notes/v*.md)
  list(SORT notes COMPARE NATURAL ORDER DESCENDING)
  if(notes MATCHES "^v([0-9]+\\.[0-9]+)\\.")
    set(${result} "${CMAKE_MATCH_1}" PARENT_SCOPE)
  endif()
endfunction()

# dual_proxy_find_pydrake(pydrake version) sets the folder of the pydrake wheel and
# its version, or both to nothing.
function(dual_proxy_find_pydrake pydrake version)
  set(${pydrake} "" PARENT_SCOPE)
  set(${version} "" PARENT_SCOPE)
  if(NOT Python_EXECUTABLE)
    return()
  endif()
  execute_process(
    COMMAND ${Python_EXECUTABLE} -c
            "import importlib.util as u; print(u.find_spec('pydrake').origin)"
    OUTPUT_VARIABLE folder OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  cmake_path(GET folder PARENT_PATH folder)
  # An installed Drake has a pydrake without these.
  if(EXISTS "${folder}/lib/libdrake.so"
     AND EXISTS "${folder}/doc/drake/VERSION.TXT")
    dual_proxy_first_word(${folder}/doc/drake/VERSION.TXT found)
    set(${pydrake} "${folder}" PARENT_SCOPE)
    set(${version} "${found}" PARENT_SCOPE)
  endif()
endfunction()

# dual_proxy_check_drake_headers(dir wheel_version header_version wrong) sets
# `header_version`, and `wrong` to what keeps the headers in `dir` from being
# used, or to nothing.
function(dual_proxy_check_drake_headers dir wheel_version header_version wrong)
  set(${wrong} "" PARENT_SCOPE)
  if(NOT EXISTS ${dir}/drake/systems/framework/leaf_system.h)
    set(${wrong} "DRAKE_INCLUDE_DIR: expected a folder with drake/systems/framework/leaf_system.h, got ${dir}" PARENT_SCOPE)
    return()
  endif()
  if(NOT EXISTS ${dir}/drake/common/autodiff_config.h)
    set(${wrong} "DRAKE_INCLUDE_DIR: ${dir}/drake/common/autodiff_config.h is missing; Drake's build generates it, for the wheel's library it is the one line `#define DRAKE_INTERNAL_USE_EIGEN_LEGACY_AUTODIFF 0`" PARENT_SCOPE)
    return()
  endif()
  dual_proxy_drake_header_version(${dir} version)
  string(FIND "${wheel_version}." "${version}." position)
  if(version STREQUAL "")
    set(version "unknown")
  elseif(NOT position EQUAL 0)
    set(${wrong} "DRAKE_INCLUDE_DIR: expected headers of Drake ${wheel_version}, as the pydrake wheel, got ${version} in ${dir}" PARENT_SCOPE)
    return()
  endif()
  set(${header_version} "${version}" PARENT_SCOPE)
endfunction()

# The wheel's library with the headers in `dir` as drake::drake.
function(dual_proxy_add_drake_wheel pydrake dir)
  if(TARGET drake::drake)
    return()
  endif()
  add_library(drake::drake SHARED IMPORTED GLOBAL)
  set_target_properties(drake::drake PROPERTIES
                        IMPORTED_LOCATION ${pydrake}/lib/libdrake.so)
  target_include_directories(drake::drake SYSTEM INTERFACE ${dir})
  # Drake's own fmt is hidden in its library, so any version will do. Its spdlog
  # is hidden, too: without HAVE_SPDLOG the headers need none, and nothing here
  # calls drake::log().
  target_link_libraries(drake::drake INTERFACE Eigen3::Eigen fmt::fmt-header-only)
  # What the library needs itself lies beside pydrake.
  target_link_options(drake::drake INTERFACE
                      LINKER:-rpath-link,${pydrake}/../drake.libs)
endfunction()

# The same for the headers as given.
macro(dual_proxy_use_drake_wheel)
  get_filename_component(drake_headers ${drake_headers} ABSOLUTE)
  dual_proxy_check_drake_headers(${drake_headers} "${pydrake_version}"
                                 header_version DUAL_PROXY_NO_DRAKE)
  find_package(fmt CONFIG QUIET)
  if(NOT DUAL_PROXY_NO_DRAKE AND NOT fmt_FOUND)
    set(DUAL_PROXY_NO_DRAKE
        "Drake's headers need fmt, which was not found (Debian: libfmt-dev)")
  endif()
  if(DUAL_PROXY_NO_DRAKE)
    set(DUAL_PROXY_BAD_DRAKE TRUE)
  else()
    dual_proxy_add_drake_wheel(${pydrake} ${drake_headers})
    set(DUAL_PROXY_DRAKE_VERSION ${pydrake_version})
    set(DUAL_PROXY_DRAKE
        "${pydrake_version}, the pydrake wheel's library; headers (version ${header_version}) in ${drake_headers}")
  endif()
endmacro()

set(DUAL_PROXY_DRAKE FALSE)
set(DUAL_PROXY_DRAKE_VERSION "")
set(DUAL_PROXY_NO_DRAKE "")
set(DUAL_PROXY_BAD_DRAKE FALSE)
set(drake_headers "${DRAKE_INCLUDE_DIR}")
if(NOT drake_headers)
  set(drake_headers "${DUAL_PROXY_ENV_DRAKE_INCLUDE_DIR}")
endif()

find_package(drake CONFIG QUIET)
dual_proxy_find_pydrake(pydrake pydrake_version)
if(drake_FOUND)
  set(DUAL_PROXY_DRAKE_VERSION "${drake_VERSION}")
  set(DUAL_PROXY_DRAKE "${drake_VERSION}, installed in ${drake_DIR}")
elseif(drake_CONSIDERED_CONFIGS)
  set(DUAL_PROXY_BAD_DRAKE TRUE)
  set(DUAL_PROXY_NO_DRAKE
      "${drake_CONSIDERED_CONFIGS} cannot be used: ${drake_NOT_FOUND_MESSAGE}")
elseif(NOT pydrake)
  set(DUAL_PROXY_NO_DRAKE
      "found neither an installed Drake (CMAKE_PREFIX_PATH) nor the pydrake wheel (Python_EXECUTABLE)")
elseif(NOT drake_headers)
  set(DUAL_PROXY_NO_DRAKE
      "the pydrake wheel has a library but no headers: give them, -DDRAKE_INCLUDE_DIR=<folder that has drake/, version ${pydrake_version}>, or an installed Drake, -DCMAKE_PREFIX_PATH=<its folder>")
else()
  dual_proxy_use_drake_wheel()
endif()
if(DUAL_PROXY_DRAKE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC 12 sees an overlap in std::string's operator+ where Drake's headers name
  # a port (GCC bug 105651); there is none.
  target_compile_options(drake::drake INTERFACE -Wno-restrict)
endif()
