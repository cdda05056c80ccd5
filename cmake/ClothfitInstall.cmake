# What `cmake --install` puts where: the program, the folders as libraries for find_package(clothfit),
# the bundled recordings, patterns and fabrics beside the program's share folder, where `clothfit demo` looks for them.

include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Pages and studies are the program's own.
get_property(libraries GLOBAL PROPERTY CLOTHFIT_LIBRARIES)
list(FILTER libraries EXCLUDE REGEX "^apps")
set(targets "")
foreach(library IN LISTS libraries)
  set_target_properties(clothfit_${library} PROPERTIES EXPORT_NAME ${library})
  list(APPEND targets clothfit_${library})
endforeach()

install(TARGETS clothfit RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS ${targets} EXPORT clothfit-targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT clothfit-targets NAMESPACE clothfit::
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/clothfit)

# Headers keep their room: #include "model/integrate/step.h" with include/clothfit as the include folder.
install(DIRECTORY data calib vision model fit
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/clothfit
  FILES_MATCHING PATTERN "*.h" PATTERN recordings EXCLUDE)
install(DIRECTORY data/recordings data/patterns data/fabrics DESTINATION ${CMAKE_INSTALL_DATADIR}/clothfit)
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/clothfit-config.cmake.in
  ${PROJECT_BINARY_DIR}/clothfit-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/clothfit)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/clothfit-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/clothfit-config.cmake
  ${PROJECT_BINARY_DIR}/clothfit-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/clothfit)
