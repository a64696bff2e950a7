# Finds C++ packages that arrive as Python wheels. cmeel wheels install under
# <site-packages>/cmeel.prefix and Ruckig's under <site-packages>/lib64, neither
# of which find_package() searches by itself. A system package found first by
# CMAKE_PREFIX_PATH serves as well.

find_package(Python 3.10 REQUIRED COMPONENTS Interpreter
             OPTIONAL_COMPONENTS Development.Module)
execute_process(
  COMMAND
    ${Python_EXECUTABLE} -c
    "import os, sys
paths = [q for p in sys.path for q in (os.path.join(p, 'cmeel.prefix'), p)]
print(';'.join(p for p in paths if p.endswith('site-packages') or
               (p.endswith('cmeel.prefix') and os.path.isdir(p))))"
  OUTPUT_VARIABLE pip_prefixes
  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
list(APPEND CMAKE_PREFIX_PATH ${pip_prefixes})
set_property(GLOBAL PROPERTY FIND_LIBRARY_USE_LIB64_PATHS ON)

macro(dual_proxy_find_ruckig)
  find_package(ruckig REQUIRED CONFIG)
  # The wheel's target asks for Ruckig's cloud client, which needs a newer
  # standard library than Debian 12 has; only the local generator is used.
  set_property(TARGET ruckig::ruckig PROPERTY INTERFACE_COMPILE_DEFINITIONS)
endmacro()
