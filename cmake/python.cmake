# The library inside the Python package (python/): the whole C interface and mesh files, in one file that needs nothing
# but the C library, whatever else the Python process has loaded.
set(draco_archive "")
if(HTVM_DRACO)
  find_library(DRACO_ARCHIVE NAMES libdraco.a)
  if(NOT DRACO_ARCHIVE)
    message(STATUS "There is no static libdraco: the library of the Python package is not built")
    return()
  endif()
  set(draco_archive ${DRACO_ARCHIVE})
endif()
set_target_properties(htvm_io PROPERTIES POSITION_INDEPENDENT_CODE ON)
add_library(htvm_python SHARED
  $<TARGET_OBJECTS:htvm_core> $<TARGET_OBJECTS:htvm_entropy> $<TARGET_OBJECTS:htvm_decoder>
  $<TARGET_OBJECTS:htvm_c_decoder> $<TARGET_OBJECTS:htvm_surface> $<TARGET_OBJECTS:htvm_encoder> $<TARGET_OBJECTS:htvm_c>
  $<TARGET_OBJECTS:htvm_io> python/native/mesh_files.cpp)
target_include_directories(htvm_python PRIVATE include src python/native)
target_link_libraries(htvm_python PRIVATE Threads::Threads tl::expected ${draco_archive})
target_link_options(htvm_python PRIVATE -static-libstdc++ -static-libgcc LINKER:--gc-sections,--no-undefined
                    LINKER:--version-script=${PROJECT_SOURCE_DIR}/src/c_api/exported_functions.map)
set_target_properties(htvm_python PROPERTIES
  OUTPUT_NAME htvm LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/python RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/python
  LINK_DEPENDS ${PROJECT_SOURCE_DIR}/src/c_api/exported_functions.map)
