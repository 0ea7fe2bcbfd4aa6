# The libraries that other projects link: htvm::decoder, htvm::encoder, htvm::c_decoder, htvm::c, htvm::draco. The names
# are the same from an installation (find_package) and within another project (add_subdirectory). Each library consists
# of the objects of some floors, which are compiled once for static and shared libraries. BUILD_SHARED_LIBS=OFF makes
# static libraries, ON shared ones. If it is not set, both are made; within another project, static ones.
if(NOT DEFINED BUILD_SHARED_LIBS AND PROJECT_IS_TOP_LEVEL)
  set(htvm_kinds static shared)
elseif(BUILD_SHARED_LIBS)
  set(htvm_kinds shared)
else()
  set(htvm_kinds static)
endif()

# Until version 1.0 the binary interface may change with every minor version.
if(PROJECT_VERSION_MAJOR EQUAL 0)
  set(htvm_soversion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
else()
  set(htvm_soversion ${PROJECT_VERSION_MAJOR})
endif()

# htvm_library(NAME [C] FLOORS ... [LINKS ...] [NEEDS ...]): makes htvm::NAME from the objects of the floors.
#   LINKS  others of these libraries that it needs
#   NEEDS  libraries from elsewhere
#   C      it is for programs in C: the shared library exports only the functions of htvm.h
function(htvm_library name)
  cmake_parse_arguments(library "C" "" "FLOORS;LINKS;NEEDS" ${ARGN})
  set(objects "")
  foreach(floor ${library_FLOORS})
    # Without -fno-semantic-interposition a program could replace any function of a shared library, so the compiler
    # could not inline calls, and position-independent code would be slower.
    set_target_properties(htvm_${floor} PROPERTIES POSITION_INDEPENDENT_CODE ON VISIBILITY_INLINES_HIDDEN ON)
    target_compile_options(htvm_${floor} PRIVATE -fno-semantic-interposition)
    list(APPEND objects $<TARGET_OBJECTS:htvm_${floor}>)
  endforeach()
  # DLLs of C++ would export every symbol, and have no place for the standard library that they share: on Windows the
  # libraries for C++ are static ones.
  set(kinds ${htvm_kinds})
  if(WIN32 AND NOT library_C)
    set(kinds static)
  endif()
  foreach(kind ${kinds})
    set(target htvm_${name}_${kind})
    string(TOUPPER ${kind} type)
    add_library(${target} ${type} ${objects})
    if(NOT HTVM_INSTALL)
      set_target_properties(${target} PROPERTIES EXCLUDE_FROM_ALL ON)
    endif()
    set_target_properties(${target} PROPERTIES
      OUTPUT_NAME htvm_${name} EXPORT_NAME ${name} LINKER_LANGUAGE CXX
      VERSION ${PROJECT_VERSION} SOVERSION ${htvm_soversion}
      ARCHIVE_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib
      RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib)
    target_include_directories(${target} INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
                                                   $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    if(NOT library_C)
      target_compile_features(${target} INTERFACE cxx_std_20)
      target_link_libraries(${target} INTERFACE tl::expected)
    endif()
    foreach(link ${library_LINKS})
      target_link_libraries(${target} PUBLIC htvm_${link}_${kind})
    endforeach()
    if(library_LINKS)
      # It finds the others beside it also where a program that does not use them itself has left them away.
      set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN")
    endif()
    if(kind STREQUAL "static")
      target_link_libraries(${target} PUBLIC Threads::Threads ${library_NEEDS})
    else()
      target_link_libraries(${target} PRIVATE Threads::Threads ${library_NEEDS})
      if(library_C)
        target_link_options(${target} PRIVATE LINKER:--version-script=${PROJECT_SOURCE_DIR}/src/c_api/exported_functions.map)
        set_target_properties(${target} PROPERTIES LINK_DEPENDS ${PROJECT_SOURCE_DIR}/src/c_api/exported_functions.map)
      endif()
    endif()
  endforeach()
  list(GET kinds 0 kind)
  add_library(htvm::${name} ALIAS htvm_${name}_${kind})
  set_property(GLOBAL APPEND PROPERTY htvm_libraries ${name})
  set_property(GLOBAL PROPERTY htvm_kinds_of_${name} ${kinds})
endfunction()

htvm_library(decoder FLOORS core entropy decoder)
# The C libraries contain all they need: one file to link, or to load from another language.
htvm_library(c_decoder C FLOORS core entropy decoder c_decoder)
if(HTVM_BUILD_ENCODER)
  htvm_library(encoder FLOORS surface encoder LINKS decoder)
  htvm_library(c C FLOORS core entropy decoder c_decoder surface encoder c)
endif()
