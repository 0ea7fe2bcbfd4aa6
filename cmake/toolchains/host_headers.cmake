# The libraries that are headers alone (tl::expected, Eigen, nanoflann) serve builds for any system, but they lie beside
# this system's own headers, which do not: here they get a folder with nothing else in it.
set(host_headers ${CMAKE_CURRENT_LIST_DIR}/../../build/host_headers)
file(MAKE_DIRECTORY ${host_headers}/include ${host_headers}/lib/cmake/tl-expected)
foreach(name tl nanoflann.hpp)
  if(EXISTS /usr/include/${name} AND NOT EXISTS ${host_headers}/include/${name})
    file(CREATE_LINK /usr/include/${name} ${host_headers}/include/${name} SYMBOLIC)
  endif()
endforeach()
file(WRITE ${host_headers}/lib/cmake/tl-expected/tl-expected-config.cmake
"if(NOT TARGET tl::expected)
  add_library(tl::expected INTERFACE IMPORTED)
  set_target_properties(tl::expected PROPERTIES INTERFACE_INCLUDE_DIRECTORIES \"${host_headers}/include\")
endif()
")
set(tl-expected_DIR ${host_headers}/lib/cmake/tl-expected CACHE PATH "Made by cmake/toolchains/host_headers.cmake")
set(Eigen3_DIR /usr/share/eigen3/cmake CACHE PATH "Where Debian keeps it")
