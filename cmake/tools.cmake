# The libraries that the programs use besides the codec.
find_package(nlohmann_json 3.10 REQUIRED)
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(PNG REQUIRED)
find_package(embree 3 REQUIRED)
find_path(DRACO_INCLUDE draco/compression/encode.h REQUIRED)
find_library(DRACO_LIBRARY draco REQUIRED)
add_library(htvm_libdraco INTERFACE)
target_include_directories(htvm_libdraco SYSTEM INTERFACE ${DRACO_INCLUDE})
target_link_libraries(htvm_libdraco INTERFACE ${DRACO_LIBRARY})

htvm_floor(io DIRECTORY src/io LINKS htvm_core htvm_libdraco nlohmann_json::nlohmann_json)
htvm_floor(synth DIRECTORY src/synth LINKS htvm_core Eigen3::Eigen)
# It reads no input, and makes what other tests need: with sanitizers it would take half of their time.
if(HTVM_SANITIZE MATCHES "address")
  target_compile_options(htvm_synth PRIVATE -fno-sanitize=all -O2)
endif()
htvm_floor(metrics DIRECTORY src/metrics LINKS htvm_core Eigen3::Eigen embree PNG::PNG)

# Draco-coded I-frames: plugs into the encoder and the decoder, which do not depend on libdraco.
file(GLOB_RECURSE draco_sources CONFIGURE_DEPENDS src/codec/*_draco.cpp)
htvm_floor(draco SOURCES ${draco_sources} LINKS htvm_decoder htvm_libdraco)
htvm_library(draco FLOORS draco LINKS decoder NEEDS $<BUILD_INTERFACE:${DRACO_LIBRARY}> $<INSTALL_INTERFACE:htvm::libdraco>)

# The programs: everything but their main.cpp is a library, so that tests reach it. htvm_app is what users run,
# htvm_laboratory what experiments need; both use htvm_command_line.
function(htvm_program_library name folder)
  file(GLOB sources CONFIGURE_DEPENDS apps/${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  add_library(htvm_${name} STATIC ${sources})
  target_include_directories(htvm_${name} PUBLIC apps apps/${folder})
  target_link_libraries(htvm_${name} PUBLIC ${ARGN})
  htvm_precompile(htvm_${name} <CLI/CLI.hpp> <fmt/core.h> <nlohmann/json.hpp> <filesystem> <string> <vector>)
  # The work is in the libraries; optimising the options and tables would take a quarter of the whole build.
  target_compile_options(htvm_${name} PRIVATE $<IF:$<CONFIG:Debug>,-O0,-O1>)
endfunction()
htvm_program_library(command_line command_line htvm_core htvm_io CLI11::CLI11 fmt::fmt nlohmann_json::nlohmann_json)
target_compile_definitions(htvm_command_line PUBLIC HTVM_VERSION="${PROJECT_VERSION}")
include(cmake/live.cmake)
htvm_program_library(app htvm htvm_command_line htvm_encoder htvm_decoder htvm_draco htvm_synth htvm_metrics htvm_live)
htvm_program_library(laboratory lab htvm_command_line htvm_encoder htvm_decoder htvm_draco htvm_synth htvm_metrics)
add_executable(htvm apps/htvm/main.cpp)
target_link_libraries(htvm PRIVATE htvm_app)
add_executable(htvm-lab apps/lab/main.cpp)
target_link_libraries(htvm-lab PRIVATE htvm_laboratory)
