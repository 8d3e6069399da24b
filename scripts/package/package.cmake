# Installed files, and their packages: a .deb, and a .tar.gz that runs from any folder.
#   cmake --preset package && cmake --build build/package --target package
set(pf_data ${CMAKE_INSTALL_DATADIR}/pickleflight)
install(TARGETS pickleflight RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(DIRECTORY shaders DESTINATION ${pf_data} COMPONENT program)
install(DIRECTORY src/lab/plots DESTINATION ${pf_data} COMPONENT program PATTERN __pycache__ EXCLUDE)
install(DIRECTORY assets/cues assets/scenes assets/lab DESTINATION ${pf_data}/assets COMPONENT program)
install(FILES README.md CHANGELOG.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(DIRECTORY assets/pictures DESTINATION ${CMAKE_INSTALL_DOCDIR}/assets COMPONENT program)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright COMPONENT program)
install(FILES scripts/package/pickleflight.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications
        COMPONENT program)
install(FILES scripts/package/pickleflight.svg
        DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps COMPONENT program)
install(FILES scripts/package/completion.bash
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME pickleflight COMPONENT program)

# Man pages, from the output of --help.
find_program(PF_HELP2MAN help2man)
if(PF_HELP2MAN)
  add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/man/pickleflight.1
    COMMAND ${PROJECT_SOURCE_DIR}/scripts/package/man-pages ${PF_HELP2MAN} $<TARGET_FILE:pickleflight>
            ${PROJECT_BINARY_DIR}/man
    DEPENDS pickleflight ${PROJECT_SOURCE_DIR}/scripts/package/man-pages VERBATIM)
  add_custom_target(man_pages ALL DEPENDS ${PROJECT_BINARY_DIR}/man/pickleflight.1)
  install(DIRECTORY ${PROJECT_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program OPTIONAL)
endif()

# Licences of the libraries that are compiled in, from Debian's packages.
foreach(package libimgui-dev libfmt-dev libtomlplusplus-dev libcli11-dev nlohmann-json3-dev python3-glad
                libhdf5-dev libaec-dev)
  install(FILES /usr/share/doc/${package}/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR}/licenses RENAME ${package}
          COMPONENT program OPTIONAL)
endforeach()

# Only in the .tar.gz: a font, the libraries, and a launcher that sets their path.
if(PF_PORTABLE)
  foreach(tool file dpkg-shlibdeps help2man)
    find_program(PF_TOOL_${tool} ${tool})
    if(NOT PF_TOOL_${tool})
      message(WARNING "Packages need ${tool}: install file, dpkg-dev and help2man")
    endif()
  endforeach()
  # DT_RPATH instead of DT_RUNPATH applies to libraries of libraries, too.
  set_target_properties(pickleflight PROPERTIES INSTALL_RPATH "$ORIGIN/../lib/pickleflight")
  target_link_options(pickleflight PRIVATE -Wl,--disable-new-dtags)
  install(FILES /usr/share/fonts/truetype/dejavu/DejaVuSans.ttf DESTINATION ${pf_data}/fonts COMPONENT libraries
          OPTIONAL EXCLUDE_FROM_ALL)
  install(PROGRAMS scripts/package/launcher DESTINATION . RENAME pickleflight COMPONENT libraries EXCLUDE_FROM_ALL)
  install(CODE "set(program \"$<TARGET_FILE:pickleflight>\")\nset(doc \"${CMAKE_INSTALL_DOCDIR}\")" COMPONENT libraries
          EXCLUDE_FROM_ALL)
  install(SCRIPT scripts/package/libraries.cmake COMPONENT libraries EXCLUDE_FROM_ALL)
endif()

set(CPACK_PACKAGE_VENDOR "the Pickleball Flight developers")
set(CPACK_PACKAGE_CONTACT "the Pickleball Flight developers <maintainers@users.noreply.github.com>")
set(CPACK_PACKAGE_DESCRIPTION "A real-time demo of a pickleball flying through air parcels, which collide with each
other and with the ball; spin bends the flight. Collision methods, from a cheap one as in games to an exact event-driven
one, run side by side with their costs and errors. Runs on a CPU, or on an NVIDIA GPU (Turing or newer) with its driver,
with bitwise equal results.")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR})
set(CPACK_PACKAGE_FILE_NAME pickleflight-${PROJECT_VERSION}-linux-${CMAKE_SYSTEM_PROCESSOR})
set(CPACK_GENERATOR DEB TGZ)
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_ARCHIVE_COMPONENT_INSTALL ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_SOURCE_DIR}/scripts/package/components.cmake)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libegl1, libgl1, fonts-dejavu-core")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "ffmpeg, libgl1-mesa-dri")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "python3-matplotlib")
include(CPack)
