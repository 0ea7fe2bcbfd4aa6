# The libraries that are headers alone (tl::expected, Eigen, nanoflann, nlohmann-json, CLI11, fmt, Boost) serve builds for any system, but they lie beside
# this system's own headers, which do not: here they get a folder with nothing else in it.
set(host_headers ${CMAKE_CURRENT_LIST_DIR}/../../build/host_headers)
file(MAKE_DIRECTORY ${host_headers}/include ${host_headers}/lib/cmake/tl-expected)
foreach(name tl nanoflann.hpp nlohmann CLI fmt boost)
  if(EXISTS /usr/include/${name} AND NOT EXISTS ${host_headers}/include/${name})
    file(CREATE_LINK /usr/include/${name} ${host_headers}/include/${name} SYMBOLIC)
  endif()
endforeach()
set(NANOFLANN_INCLUDE ${host_headers}/include CACHE PATH "Made by cmake/toolchains/host_headers.cmake")
file(WRITE ${host_headers}/lib/cmake/tl-expected/tl-expected-config.cmake
"if(NOT TARGET tl::expected)
  add_library(tl::expected INTERFACE IMPORTED)
  set_target_properties(tl::expected PROPERTIES INTERFACE_INCLUDE_DIRECTORIES \"${host_headers}/include\")
endif()
")
set(tl-expected_DIR ${host_headers}/lib/cmake/tl-expected CACHE PATH "Made by cmake/toolchains/host_headers.cmake")
file(WRITE ${host_headers}/lib/cmake/nlohmann_json/nlohmann_json-config.cmake
"if(NOT TARGET nlohmann_json::nlohmann_json)
  add_library(nlohmann_json::nlohmann_json INTERFACE IMPORTED)
  set_target_properties(nlohmann_json::nlohmann_json PROPERTIES INTERFACE_INCLUDE_DIRECTORIES \"${host_headers}/include\")
endif()
")
file(WRITE ${host_headers}/lib/cmake/nlohmann_json/nlohmann_json-config-version.cmake
"set(PACKAGE_VERSION 3.11)
set(PACKAGE_VERSION_COMPATIBLE TRUE)
")
set(nlohmann_json_DIR ${host_headers}/lib/cmake/nlohmann_json CACHE PATH "Made by cmake/toolchains/host_headers.cmake")
set(Eigen3_DIR /usr/share/eigen3/cmake CACHE PATH "Where Debian keeps it")
# A package of headers as an interface target: its name, the target, the version, definitions.
function(htvm_host_package package target version)
  file(WRITE ${host_headers}/lib/cmake/${package}/${package}Config.cmake
"if(NOT TARGET ${target})
  add_library(${target} INTERFACE IMPORTED)
  set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES \"${host_headers}/include\"
                        INTERFACE_COMPILE_DEFINITIONS \"${ARGN}\")
endif()
")
  file(WRITE ${host_headers}/lib/cmake/${package}/${package}ConfigVersion.cmake
"set(PACKAGE_VERSION ${version})
set(PACKAGE_VERSION_COMPATIBLE TRUE)
")
  set(${package}_DIR ${host_headers}/lib/cmake/${package} CACHE PATH "Made by cmake/toolchains/host_headers.cmake")
endfunction()
htvm_host_package(CLI11 CLI11::CLI11 2)
htvm_host_package(fmt fmt::fmt 9 FMT_HEADER_ONLY=1)
set(Boost_NO_BOOST_CMAKE ON CACHE BOOL "Its headers are found by CMake's own module")
set(Boost_INCLUDE_DIR ${host_headers}/include CACHE PATH "Made by cmake/toolchains/host_headers.cmake")
