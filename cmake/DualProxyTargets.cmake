# The rules for every target of this project, in one place.

# C++20 without extensions, position independent, warnings are errors.
function(dual_proxy_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF
                                             POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Werror)
endfunction()

# dual_proxy_drake_sources(file.cc ...) adds Drake faces of the current folder,
# where Drake was found.
function(dual_proxy_drake_sources)
  if(TARGET dual_proxy_drake)
    target_sources(dual_proxy_drake PRIVATE ${ARGN})
  endif()
endfunction()

# dual_proxy_add_gtest(name_test) builds name_test.cc and registers it; every
# test can count heap allocations (tests/common/no_alloc.h).
function(dual_proxy_add_gtest name)
  add_executable(${name} ${name}.cc)
  dual_proxy_compile_options(${name})
  target_link_libraries(${name} PRIVATE dual_proxy dual_proxy_test_common
                                        GTest::gtest_main)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT 120)
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
