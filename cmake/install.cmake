# What `cmake --install` installs, and where. cmake/packages.cmake makes Debian packages of it. The components are:
# programs; runtime (the shared libraries); draco, live and texture (those that need libdraco, OpenSSL, coders of video); development.
include(CMakePackageConfigHelpers)
set(htvm_cmake_folder ${CMAKE_INSTALL_LIBDIR}/cmake/htvm)
get_property(htvm_libraries GLOBAL PROPERTY htvm_libraries)

install(DIRECTORY include/htvm DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)

# One export file per library and kind: find_package() reads only the requested ones.
foreach(library ${htvm_libraries})
  if(library MATCHES "^(draco|live|texture)$")
    set(runtime ${library})
  else()
    set(runtime runtime)
  endif()
  get_property(kinds GLOBAL PROPERTY htvm_kinds_of_${library})
  foreach(kind ${kinds})
    install(TARGETS htvm_${library}_${kind} EXPORT htvm-${library}-${kind}
            RUNTIME COMPONENT ${runtime}
            ARCHIVE COMPONENT development
            LIBRARY COMPONENT ${runtime} NAMELINK_COMPONENT development)
    install(EXPORT htvm-${library}-${kind} NAMESPACE htvm:: DESTINATION ${htvm_cmake_folder} COMPONENT development)
  endforeach()
endforeach()
configure_file(cmake/htvm-config.cmake.in install/htvm-config.cmake @ONLY)
write_basic_package_version_file(install/htvm-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/install/htvm-config.cmake ${PROJECT_BINARY_DIR}/install/htvm-config-version.cmake
        DESTINATION ${htvm_cmake_folder} COMPONENT development)

# pkg-config: the prefix is relative to the .pc file, so that an installation can be moved.
file(RELATIVE_PATH prefix_from_pkgconfig ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_LIBDIR BASE_DIRECTORY ${CMAKE_INSTALL_PREFIX} OUTPUT_VARIABLE pc_libdir)
cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_INCLUDEDIR BASE_DIRECTORY ${CMAKE_INSTALL_PREFIX} OUTPUT_VARIABLE pc_includedir)
# What a C compiler needs to link a static library of C++ code.
set(pc_cxx_libraries "")
foreach(library ${CMAKE_CXX_IMPLICIT_LINK_LIBRARIES})
  if(library MATCHES "^(stdc\\+\\+|c\\+\\+|m)$" AND NOT "-l${library}" IN_LIST pc_cxx_libraries)
    list(APPEND pc_cxx_libraries -l${library})
  endif()
endforeach()
list(JOIN pc_cxx_libraries " " pc_cxx_libraries)
function(htvm_pkg_config library description requires private)
  string(REPLACE _ - pc_name htvm-${library})
  set(pc_library htvm_${library})
  set(pc_description ${description})
  set(pc_requires "${requires}")
  set(pc_private "${private} ${pc_cxx_libraries} ${CMAKE_THREAD_LIBS_INIT} -pthread")
  string(STRIP "${pc_private}" pc_private)
  string(REGEX REPLACE " +" " " pc_private "${pc_private}")
  configure_file(cmake/htvm.pc.in install/${pc_name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/install/${pc_name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
          COMPONENT development)
endfunction()
set(description_decoder "Decoder of compressed human time-varying meshes, for C++20 (needs the header tl/expected.hpp)")
set(description_encoder "Encoder of human time-varying meshes, for C++20 (needs the header tl/expected.hpp)")
set(description_c_decoder "Decoder of compressed human time-varying meshes, for C")
set(description_c "Encoder and decoder of human time-varying meshes, for C")
set(description_draco "I-frames by Draco, for htvm's encoder and decoder")
set(description_texture "The pictures of textured human time-varying meshes as video, for C++20 (needs the header tl/expected.hpp)")
set(description_live "Publisher of live streams of human time-varying meshes, for C++20 (needs the header tl/expected.hpp)")
foreach(library ${htvm_libraries})
  set(requires "")
  if(library MATCHES "^(encoder|draco|live|texture)$")
    set(requires "htvm-decoder = ${PROJECT_VERSION}")
  endif()
  set(private "")
  if(library STREQUAL "draco")
    set(private -ldraco)
  elseif(library STREQUAL "live")
    set(private "-lssl -lcrypto")
  elseif(library STREQUAL "texture")
    set(private "-laom -lvpx -ldav1d")
  endif()
  htvm_pkg_config(${library} "${description_${library}}" "${requires}" "${private}")
endforeach()

# The programs, and their man pages and completions, which the programs write from the options that they parse.
if(HTVM_BUILD_TOOLS)
  install(TARGETS htvm htvm-lab COMPONENT programs)
  set(pages "")
  foreach(program htvm htvm-lab)
    set(stamp ${PROJECT_BINARY_DIR}/install/${program}.pages)
    add_custom_command(OUTPUT ${stamp}
      COMMAND ${program} --write-pages ${PROJECT_BINARY_DIR}/install/pages
      COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
      DEPENDS ${program} COMMENT "Man pages and completions of ${program}" VERBATIM)
    list(APPEND pages ${stamp})
  endforeach()
  add_custom_target(htvm_pages ALL DEPENDS ${pages})
  set(pages ${PROJECT_BINARY_DIR}/install/pages)
  install(DIRECTORY ${pages}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT programs)
  install(DIRECTORY ${pages}/bash/ DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT programs)
  # Debian's zsh looks for the completions of packages in a folder of its own.
  set(zsh_folder site-functions)
  if(CMAKE_INSTALL_PREFIX STREQUAL "/usr" AND EXISTS /etc/debian_version)
    set(zsh_folder vendor-completions)
  endif()
  install(DIRECTORY ${pages}/zsh/ DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/${zsh_folder} COMPONENT programs)
  install(DIRECTORY ${pages}/fish/ DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT programs)
endif()

if(PROJECT_IS_TOP_LEVEL)
  include(cmake/packages.cmake)
endif()
