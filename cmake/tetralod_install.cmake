# Headers, libraries, pkg-config file, CMake package, program, licence and the bench script of the peer.

include(CMakePackageConfigHelpers)

set(PACKAGE_FOLDER ${CMAKE_INSTALL_LIBDIR}/cmake/tetralod)
install(DIRECTORY include/tetralod DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY bench/ DESTINATION ${CMAKE_INSTALL_DATADIR}/tetralod FILES_MATCHING PATTERN "*.py")
if(TARGET tetralod_cli)
  install(TARGETS tetralod_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

if(TARGET tetralod_view)
  install(TARGETS tetralod_view RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

# The two libraries have an export set each, so that a user of the shared one needs nothing else.
set_target_properties(tetralod PROPERTIES EXPORT_NAME static)
install(TARGETS tetralod EXPORT tetralod_static ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT tetralod_static NAMESPACE tetralod:: FILE tetralod-static.cmake DESTINATION ${PACKAGE_FOLDER})
if(TETRALOD_SHARED)
  set_target_properties(tetralod_shared PROPERTIES EXPORT_NAME shared)
  install(TARGETS tetralod_shared EXPORT tetralod_shared LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT tetralod_shared NAMESPACE tetralod:: FILE tetralod-shared.cmake DESTINATION ${PACKAGE_FOLDER})
endif()

configure_package_config_file(cmake/tetralod-config.cmake.in tetralod-config.cmake
  INSTALL_DESTINATION ${PACKAGE_FOLDER})
write_basic_package_version_file(tetralod-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/tetralod-config.cmake ${PROJECT_BINARY_DIR}/tetralod-config-version.cmake
        DESTINATION ${PACKAGE_FOLDER})

# The prefix stands relative to the .pc file, so that an installed tree may be moved.
file(RELATIVE_PATH PC_PREFIX ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
configure_file(cmake/tetralod.pc.in tetralod.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/tetralod.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
