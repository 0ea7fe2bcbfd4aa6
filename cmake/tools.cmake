# What the command line is made of besides the codec.
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
# It reads nothing, and makes what the tests of all else need: under sanitizers that would take half of their time.
if(HTVM_SANITIZE MATCHES "address")
  target_compile_options(htvm_synth PRIVATE -fno-sanitize=all -O2)
endif()
htvm_floor(metrics DIRECTORY src/metrics LINKS htvm_core Eigen3::Eigen embree PNG::PNG)

# Draco-coded I-frames: plugs into the encoder and the decoder, which do not know libdraco.
file(GLOB_RECURSE draco_sources CONFIGURE_DEPENDS src/codec/*_draco.cpp)
htvm_floor(draco SOURCES ${draco_sources} LINKS htvm_decoder htvm_libdraco)

# The command line: everything but main.cpp is a library, so that tests reach it.
file(GLOB app_sources CONFIGURE_DEPENDS apps/htvm/*.cpp)
list(FILTER app_sources EXCLUDE REGEX "/main\\.cpp$")
add_library(htvm_app STATIC ${app_sources})
target_include_directories(htvm_app PUBLIC apps/htvm)
target_link_libraries(htvm_app PUBLIC htvm_encoder htvm_decoder htvm_draco htvm_io htvm_synth htvm_metrics
                                      CLI11::CLI11 fmt::fmt nlohmann_json::nlohmann_json)
htvm_precompile(htvm_app <CLI/CLI.hpp> <fmt/core.h> <nlohmann/json.hpp> <filesystem> <string> <vector>)
# The work is in the libraries; optimising the options and tables would take a quarter of the whole build.
target_compile_options(htvm_app PRIVATE $<IF:$<CONFIG:Debug>,-O0,-O1>)
target_compile_definitions(htvm_app PUBLIC HTVM_VERSION="${PROJECT_VERSION}")
add_executable(htvm apps/htvm/main.cpp)
target_link_libraries(htvm PRIVATE htvm_app)
install(TARGETS htvm)
