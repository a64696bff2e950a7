# cmake --install <build> [--component dev] installs what other C++ projects use
# by find_package(dual_proxy). The Python package is the component `python`, which
# goes into a wheel and not into this installation.

include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dual_proxy)

# Each library has a set of targets of its own: the algorithms alone need no Drake.
foreach(library dual_proxy dual_proxy_drake)
  if(TARGET ${library})
    install(TARGETS ${library} EXPORT ${library}Targets
            ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
            INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
    install(EXPORT ${library}Targets NAMESPACE dual_proxy::
            DESTINATION ${package_dir} COMPONENT dev)
  endif()
endforeach()

foreach(folder ${DUAL_PROXY_FOLDERS})
  set(path ${PROJECT_SOURCE_DIR}/${folder})
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE ${path} ${path}/*.h)
  get_property(left_out DIRECTORY ${path} PROPERTY dual_proxy_headers_left_out)
  list(REMOVE_ITEM headers ${left_out})
  cmake_path(GET folder FILENAME name)
  foreach(header ${headers})
    cmake_path(GET header PARENT_PATH subfolder)
    install(FILES ${path}/${header} COMPONENT dev
            DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/dual_proxy/${name}/${subfolder})
  endforeach()
endforeach()

configure_package_config_file(
  ${PROJECT_SOURCE_DIR}/cmake/dual_proxyConfig.cmake.in
  ${PROJECT_BINARY_DIR}/dual_proxyConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(
  ${PROJECT_BINARY_DIR}/dual_proxyConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dual_proxyConfig.cmake
              ${PROJECT_BINARY_DIR}/dual_proxyConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindPipPackages.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindDrakeLibrary.cmake
        DESTINATION ${package_dir} COMPONENT dev)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE
        DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT dev)
