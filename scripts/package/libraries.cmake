# Run when the .tar.gz is made: copies the libraries that `program` links, except for those of every Linux system, with
# their licences. The client libraries of X are in a separate folder, x11: graphics drivers expect the system's own, so
# the launcher uses these only if it has none. Input: program, doc.
file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${program} RESOLVED_DEPENDENCIES_VAR libraries
     PRE_EXCLUDE_REGEXES "^ld-linux" "^linux-vdso" "^lib(c|m|dl|rt|pthread|stdc\\+\\+|gcc_s)\\.so")
set(root $ENV{DESTDIR}${CMAKE_INSTALL_PREFIX})
file(MAKE_DIRECTORY ${root}/${doc}/licenses)
foreach(library ${libraries})
  get_filename_component(name ${library} NAME)
  set(folder ${root}/lib/pickleflight)
  if(name MATCHES "^lib(X|xcb|bsd|md)")
    string(APPEND folder /x11)
  endif()
  file(COPY ${library} DESTINATION ${folder} FOLLOW_SYMLINK_CHAIN)
  execute_process(COMMAND dpkg -S */${name} OUTPUT_VARIABLE owner ERROR_QUIET)
  string(REGEX REPLACE "[:,].*" "" owner "${owner}")
  if(owner AND EXISTS /usr/share/doc/${owner}/copyright)
    file(COPY_FILE /usr/share/doc/${owner}/copyright ${root}/${doc}/licenses/${owner})
  endif()
endforeach()
if(EXISTS /usr/share/doc/fonts-dejavu-core/copyright)
  file(COPY_FILE /usr/share/doc/fonts-dejavu-core/copyright ${root}/${doc}/licenses/fonts-dejavu-core)
endif()
