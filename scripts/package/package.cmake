# What is installed, and the packages made of it: a .deb and a .tar.gz that runs from wherever it is unpacked.
#   cmake --preset package && cmake --build build/package --target package
set(pf_data ${CMAKE_INSTALL_DATADIR}/pickleflight)
install(TARGETS pickleflight RUNTIME_DEPENDENCY_SET pf_libraries
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(DIRECTORY shaders DESTINATION ${pf_data} COMPONENT program)
install(DIRECTORY src/lab/plots DESTINATION ${pf_data} COMPONENT program PATTERN __pycache__ EXCLUDE)
install(DIRECTORY assets/scenes assets/lab DESTINATION ${pf_data}/assets COMPONENT program)
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(FILES scripts/package/pickleflight.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications
        COMPONENT program)
install(FILES scripts/package/pickleflight.svg
        DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps COMPONENT program)
install(FILES scripts/package/completion.bash
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME pickleflight COMPONENT program)

# Man pages are what --help says.
find_program(PF_HELP2MAN help2man)
if(PF_HELP2MAN)
  add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/man/pickleflight.1
    COMMAND ${PROJECT_SOURCE_DIR}/scripts/package/man-pages ${PF_HELP2MAN} $<TARGET_FILE:pickleflight>
            ${PROJECT_BINARY_DIR}/man
    DEPENDS pickleflight ${PROJECT_SOURCE_DIR}/scripts/package/man-pages VERBATIM)
  add_custom_target(man_pages ALL DEPENDS ${PROJECT_BINARY_DIR}/man/pickleflight.1)
  install(DIRECTORY ${PROJECT_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
endif()

# Of the .tar.gz alone: its libraries, but for those that every Linux system has, and a font. The client libraries of
# X lie apart: graphics drivers expect the system's own, so these serve only where the system has none.
set(pf_system_libraries "^ld-linux" "^linux-vdso" "^lib(c|m|dl|rt|pthread|stdc\\+\\+|gcc_s)\\.so")
install(RUNTIME_DEPENDENCY_SET pf_libraries PRE_EXCLUDE_REGEXES ${pf_system_libraries} "^lib(X|xcb|bsd|md)"
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/pickleflight COMPONENT libraries EXCLUDE_FROM_ALL)
