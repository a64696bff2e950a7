# Finds Drake for C++ as the target drake::drake, in this order:
#
# 1. an installed Drake, by find_package(drake CONFIG);
# 2. the library in the pydrake wheel of the Python environment, together with
#    the headers of the same version in DRAKE_INCLUDE_DIR, the folder that has
#    drake/systems/... below it (the wheel has no headers).
#
# Sets DUAL_PROXY_DRAKE to a line that says what was found, or to false, and then
# DUAL_PROXY_NO_DRAKE to a line that says what is missing and how to get it.

set(DRAKE_INCLUDE_DIR "$ENV{DRAKE_INCLUDE_DIR}"
    CACHE PATH "Drake's headers, of the version of the pydrake wheel")

# dual_proxy_drake_header_version(dir result) sets `result` to the version of the
# headers in dir/drake, as far as the folder tells: X.Y.Z, X.Y or nothing.
function(dual_proxy_drake_header_version dir result)
  foreach(file ${dir}/../share/doc/drake/VERSION.TXT ${dir}/drake/VERSION.TXT
               ${dir}/VERSION.TXT)
    if(EXISTS ${file})
      file(STRINGS ${file} version REGEX "^[0-9]+\\.[0-9]+\\.[0-9]+" LIMIT_COUNT 1)
      string(REGEX MATCH "^[0-9]+\\.[0-9]+\\.[0-9]+" version "${version}")
      set(${result} "${version}" PARENT_SCOPE)
      return()
    endif()
  endforeach()
  if(EXISTS ${dir}/drake/.git)
    execute_process(
      COMMAND git -C ${dir}/drake describe --tags --exact-match --match "v*"
      OUTPUT_VARIABLE tag OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(tag MATCHES "^v([0-9]+\\.[0-9]+\\.[0-9]+)$")
      set(${result} "${CMAKE_MATCH_1}" PARENT_SCOPE)
      return()
    endif()
  endif()
  # Drake's source tree tells its version nowhere but in its newest notes.
  file(GLOB notes RELATIVE ${dir}/drake/doc/_release-notes
       ${dir}/drake/doc/_release-notes/v*.md)
  list(SORT notes COMPARE NATURAL ORDER DESCENDING)
  if(notes MATCHES "^v([0-9]+\\.[0-9]+)\\.")
    set(${result} "${CMAKE_MATCH_1}" PARENT_SCOPE)
  else()
    set(${result} "" PARENT_SCOPE)
  endif()
endfunction()

# The wheel's library and the headers in DRAKE_INCLUDE_DIR as drake::drake.
macro(dual_proxy_find_drake_wheel)
  execute_process(
    COMMAND ${Python_EXECUTABLE} -c
            "import importlib.util as u; print(u.find_spec('pydrake').origin)"
    OUTPUT_VARIABLE pydrake OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  get_filename_component(pydrake "${pydrake}" DIRECTORY)
  if(NOT EXISTS "${pydrake}/lib/libdrake.so")
    set(DUAL_PROXY_NO_DRAKE
        "neither an installed Drake (set CMAKE_PREFIX_PATH) nor the pydrake wheel was found")
  elseif(NOT DRAKE_INCLUDE_DIR)
    file(STRINGS ${pydrake}/doc/drake/VERSION.TXT wheel_version LIMIT_COUNT 1)
    string(REGEX MATCH "^[^ ]+" wheel_version "${wheel_version}")
    set(DUAL_PROXY_NO_DRAKE
        "for the pydrake wheel's library give its headers with -DDRAKE_INCLUDE_DIR=<parent of drake/, version ${wheel_version}>, or install Drake and set CMAKE_PREFIX_PATH")
  else()
    dual_proxy_use_drake_wheel(${pydrake})
  endif()
endmacro()

function(dual_proxy_use_drake_wheel pydrake)
  file(STRINGS ${pydrake}/doc/drake/VERSION.TXT wheel_version LIMIT_COUNT 1)
  string(REGEX MATCH "^[^ ]+" wheel_version "${wheel_version}")
  get_filename_component(dir ${DRAKE_INCLUDE_DIR} ABSOLUTE)
  if(NOT EXISTS ${dir}/drake/systems/framework/leaf_system.h)
    message(FATAL_ERROR "DRAKE_INCLUDE_DIR: expected a folder with "
                        "drake/systems/framework/leaf_system.h, got ${dir}")
  endif()
  if(NOT EXISTS ${dir}/drake/common/autodiff_config.h)
    message(
      FATAL_ERROR
        "DRAKE_INCLUDE_DIR: ${dir}/drake/common/autodiff_config.h is missing. "
        "Drake's build generates it; for the wheel it is the one line\n"
        "#define DRAKE_INTERNAL_USE_EIGEN_LEGACY_AUTODIFF 0")
  endif()
  dual_proxy_drake_header_version(${dir} header_version)
  if(header_version STREQUAL "")
    set(header_version "unknown")
  elseif(NOT "${wheel_version}." MATCHES "^${header_version}\\.")
    message(FATAL_ERROR "DRAKE_INCLUDE_DIR: the headers in ${dir} are of Drake "
                        "${header_version}, the library in ${pydrake} is of "
                        "${wheel_version}; they must be of the same version")
  endif()
  find_package(fmt REQUIRED CONFIG)

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
  set(DUAL_PROXY_DRAKE
      "${wheel_version}, the pydrake wheel's library; headers (version ${header_version}) in ${dir}"
      PARENT_SCOPE)
endfunction()

set(DUAL_PROXY_DRAKE FALSE)
find_package(drake CONFIG QUIET)
if(drake_FOUND)
  set(DUAL_PROXY_DRAKE "${drake_VERSION}, installed in ${drake_DIR}")
else()
  dual_proxy_find_drake_wheel()
endif()
if(DUAL_PROXY_DRAKE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC 12 sees an overlap in std::string's operator+ where Drake's headers name
  # a port (GCC bug 105651); there is none.
  target_compile_options(drake::drake INTERFACE -Wno-restrict)
endif()
