# Lets find_package() see C++ packages that arrive as Python wheels: cmeel wheels
# install under <site-packages>/cmeel.prefix and Ruckig's under
# <site-packages>/lib64, neither of which it searches by itself. Packages found by
# the project's own CMAKE_PREFIX_PATH go first; without Python only these are left.

find_package(Python 3.11 QUIET COMPONENTS Interpreter)
if(Python_Interpreter_FOUND)
  execute_process(
    COMMAND
      ${Python_EXECUTABLE} -c
      "import os, sys
names = ['cmeel.prefix', '', os.path.join('lib64', 'cmake')]
paths = [os.path.join(p, n) for p in sys.path for n in names
         if p.endswith('-packages')]
print(';'.join(p for p in paths if os.path.isdir(p)))"
    OUTPUT_VARIABLE pip_prefixes
    OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  list(APPEND CMAKE_PREFIX_PATH ${pip_prefixes})
endif()
