# src/io: mesh and skeleton files, for the programs and for the Python package. Draco's files need libdraco, which the
# programs use for more; the Python package reads all but those without it.
find_package(nlohmann_json 3.10 REQUIRED)
find_path(DRACO_INCLUDE draco/compression/encode.h)
find_library(DRACO_LIBRARY draco)
set(draco_found OFF)
if(DRACO_INCLUDE AND DRACO_LIBRARY)
  set(draco_found ON)
endif()
# The programs leave it out where they are told to (cmake/abilities.cmake), the Python package where it is not there.
if(NOT DEFINED HTVM_DRACO)
  set(HTVM_DRACO ${draco_found})
endif()
if(HTVM_DRACO AND NOT draco_found)
  message(FATAL_ERROR "libdraco is not there (libdraco-dev); HTVM_DRACO=OFF leaves it out")
endif()

# Images and textures are apart (cmake/tools.cmake), and the programs that read videos of them, so that the Python library,
# which reads meshes alone, needs none of their libraries.
file(GLOB io_sources CONFIGURE_DEPENDS src/io/*.cpp)
list(FILTER io_sources EXCLUDE REGEX "/((image|texture)_[a-z_]*|child_program)\\.cpp$")
if(HTVM_DRACO)
  add_library(htvm_libdraco INTERFACE)
  target_include_directories(htvm_libdraco SYSTEM INTERFACE ${DRACO_INCLUDE})
  target_link_libraries(htvm_libdraco INTERFACE ${DRACO_LIBRARY})
  list(FILTER io_sources EXCLUDE REGEX "/draco_geometry_absent\\.cpp$")
  set(io_needs htvm_libdraco)
else()
  list(FILTER io_sources EXCLUDE REGEX "/draco_geometry\\.cpp$")
  set(io_needs "")
endif()
htvm_floor(io SOURCES ${io_sources} LINKS htvm_core ${io_needs} nlohmann_json::nlohmann_json)
if(CMAKE_CROSSCOMPILING)
  # At -O1, g++ 12 for ARM warns of a use before initialisation that does not exist.
  set_source_files_properties(src/io/skeleton_rate.cpp PROPERTIES COMPILE_OPTIONS -Wno-maybe-uninitialized)
endif()
