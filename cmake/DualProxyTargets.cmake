# The rules for every target of this project, in one place.

# C++20 without extensions, position independent, with warnings. Only developers and
# CI make them errors (`make lint`, by CMAKE_COMPILE_WARNING_AS_ERROR): a compiler
# that is newer than theirs must not keep anybody from a build.
#
# And, for the target and all that link to it, no AVX on x86-64. Drake's binaries
# are built without it, and so may be an installed dual_proxy; Eigen then aligns
# to 16 bytes and allocates with malloc(). With AVX it aligns to 32 or 64, and
# allocates by a way of its own: what one side has allocated the other cannot
# free, and types differ in layout. -march=native in CMAKE_CXX_FLAGS is enough to
# crash. No definition for Eigen repairs that: EIGEN_MAX_ALIGN_BYTES=16 leaves the
# allocation as it is, and EIGEN_MALLOC_ALREADY_ALIGNED=1 with it lets products of
# large matrices, which rely on aligned blocks, crash. All else in -march=native
# does no harm. On aarch64 Eigen aligns to 16 bytes whatever the flags.
function(dual_proxy_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF
                                             POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic)
  # Nobody reads errno after sqrt() nor traps floating-point exceptions; without
  # them loops can be vectorised. Results are the same bits.
  target_compile_options(${target} PRIVATE -fno-math-errno -fno-trapping-math)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
    target_compile_options(${target} PUBLIC $<$<COMPILE_LANGUAGE:CXX>:-mno-avx>)
  endif()
endfunction()

# dual_proxy_add_folder(systems/link) adds a folder of sources, whose headers are
# included as "dual_proxy/link/...", as users of an installed package do.
function(dual_proxy_add_folder folder)
  cmake_path(GET folder FILENAME name)
  file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/headers/dual_proxy)
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${folder}
       ${PROJECT_BINARY_DIR}/headers/dual_proxy/${name} SYMBOLIC)
  add_subdirectory(${folder})
endfunction()

# dual_proxy_drake_sources(file.cc ...) adds Drake faces of the current folder,
# where Drake was found. Where it was not, their headers, of the same names, are
# not installed.
function(dual_proxy_drake_sources)
  if(TARGET dual_proxy_drake)
    target_sources(dual_proxy_drake PRIVATE ${ARGN})
  else()
    list(TRANSFORM ARGN REPLACE "^(.*/)?([^/]+)\\.cc$" "\\2.h")
    set_property(DIRECTORY APPEND PROPERTY dual_proxy_headers_left_out ${ARGN})
  endif()
endfunction()

# dual_proxy_vectorised_sources(file.cc ...) marks sources of the current folder
# whose loops are compiled for several instruction sets (common/
# per_instruction_set.h): no contraction of a * b + c, so that all of them come to
# the same bits, and the optimisation that vectorises.
function(dual_proxy_vectorised_sources)
  set_property(SOURCE ${ARGN} TARGET_DIRECTORY dual_proxy APPEND PROPERTY
               COMPILE_OPTIONS -ffp-contract=off $<$<NOT:$<CONFIG:Debug>>:-O3>)
endfunction()

# dual_proxy_add_gtest(name_test) builds name_test.cc and registers it; every
# test can count heap allocations (tests/common/no_alloc.h).
function(dual_proxy_add_gtest name)
  add_executable(${name} ${name}.cc)
  dual_proxy_compile_options(${name})
  target_link_libraries(${name} PRIVATE dual_proxy dual_proxy_test_common
                                        GTest::gtest_main)
  add_test(NAME ${name} COMMAND ${name})
  set(timeout 120)
  if(DUAL_PROXY_SANITIZE)
    set(timeout 1200) # They make it ten times as slow.
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${timeout})
endfunction()

# dual_proxy_add_drake_gtest(name_test) is dual_proxy_add_gtest() with the Drake
# faces and the label "drake"; it does nothing where Drake was not found.
function(dual_proxy_add_drake_gtest name)
  if(TARGET dual_proxy_drake)
    dual_proxy_add_gtest(${name})
    target_link_libraries(${name} PRIVATE dual_proxy_drake)
    set_tests_properties(${name} PROPERTIES LABELS drake)
  endif()
endfunction()
