find_package(benchmark REQUIRED)
file(GLOB benchmark_sources CONFIGURE_DEPENDS bench/*.cpp)
if(benchmark_sources)
  add_executable(htvm_bench ${benchmark_sources})
  target_include_directories(htvm_bench PRIVATE ${PROJECT_SOURCE_DIR}/apps)
  target_link_libraries(htvm_bench PRIVATE htvm_command_line htvm_encoder htvm_decoder htvm_draco htvm_synth htvm_libdraco
                                           benchmark::benchmark_main)
endif()
# Viewers for ./dev live-load and lossy-line.
add_executable(live_watch bench/live/watch.cpp)
target_link_libraries(live_watch PRIVATE htvm_live_client htvm_decoder CLI11::CLI11 fmt::fmt)
# The pace of encoding a capture: docs/performance.md.
add_executable(htvm_pace bench/pace/pace.cpp)
target_link_libraries(htvm_pace PRIVATE htvm_encoder htvm_io htvm_synth CLI11::CLI11 fmt::fmt)
# The pace of decoding a stream: docs/performance.md.
add_executable(htvm_decode_pace bench/pace/decode_pace.cpp)
target_link_libraries(htvm_decode_pace PRIVATE htvm_decoder CLI11::CLI11 fmt::fmt)
