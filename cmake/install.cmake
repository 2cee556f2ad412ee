# What `cmake --install` puts where, below any prefix and in places relative to each other: the program finds its page and
# its decoder from where it is itself. docs/install.md.
include(CMakePackageConfigHelpers)

# Programs.
install(TARGETS btms RUNTIME DESTINATION bin)
if(TARGET btms-mpi)
  install(TARGETS btms-mpi RUNTIME DESTINATION bin)
endif()
install(PROGRAMS apps/demo.sh DESTINATION share/btms)
install(DIRECTORY ${PROJECT_BINARY_DIR}/share/ DESTINATION share)  # manual page, completion; page and decoder where npm was

# Libraries for programs in C++: find_package(Btms), then btms::engine, btms::io, btms::client, btms::robotics.
add_library(btms_robotics INTERFACE)
add_library(btms::robotics ALIAS btms_robotics)
target_include_directories(btms_robotics INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/btms>)
foreach(library flags engine io client robotics)
  set_target_properties(btms_${library} PROPERTIES EXPORT_NAME ${library})
  install(TARGETS btms_${library} EXPORT BtmsTargets ARCHIVE DESTINATION lib)
endforeach()
install(EXPORT BtmsTargets NAMESPACE btms:: DESTINATION lib/cmake/Btms)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/BtmsConfig.cmake.in ${PROJECT_BINARY_DIR}/BtmsConfig.cmake
  INSTALL_DESTINATION lib/cmake/Btms)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/BtmsConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/BtmsConfig.cmake ${PROJECT_BINARY_DIR}/BtmsConfigVersion.cmake DESTINATION lib/cmake/Btms)

# Headers, but for those that wrap HDF5, PROJ and JSON for io itself.
install(DIRECTORY engine io robotics
  DESTINATION include/btms FILES_MATCHING PATTERN *.h
  REGEX "/io/(store/(hdf5|hdf5_chunks|cf_file|chunk_grid|json_field)|crs/proj_[a-z]+)\\.h$" EXCLUDE)

# Documents, and the schema of --config files (what `btms params --schema` prints, a test sees to it).
install(FILES LICENSE README.md cmake/copyright DESTINATION share/doc/btms)
install(FILES docs/config.schema.json DESTINATION share/btms)
install(DIRECTORY docs/ DESTINATION share/doc/btms/docs)

add_custom_target(installed DEPENDS btms pages btms_client btms_io btms_engine)  # what the rules above copy
foreach(target btms-mpi viewer laz)
  if(TARGET ${target})
    add_dependencies(installed ${target})
  endif()
endforeach()

if(NOT PROJECT_IS_TOP_LEVEL)
  return()
endif()

# The same as a Debian package: `cpack --config build/release/CPackConfig.cmake` (tests/package.sh).
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME btms)
set(CPACK_PACKAGE_CONTACT "The B-TMS Engine authors <btms@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS nodejs)  # runs the LAZ decoder
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "cmake, g++, pkg-config, libeigen3-dev, libtbb-dev, libhdf5-dev, libpng-dev, libtiff-dev, libproj-dev, libxxhash-dev, libisal-dev, libseccomp-dev")
set(CPACK_PACKAGE_DESCRIPTION "The program btms, the page of its tile server, and its libraries for C++.\n\
 Point clouds in, one seamless terrain map out: airborne tiles, robot maps and single scans.")
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # cpack and install take what `installed` has built, not tests and benchmarks
include(CPack)
