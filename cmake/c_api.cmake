# The C interface (htvm/htvm.h): the decoder part, which needs only the standard library, and the encoder part.
htvm_floor(c_decoder SOURCES src/c_api/c_status.cpp src/c_api/c_decoder.cpp src/c_api/c_dependency.cpp LINKS htvm_decoder)
if(HTVM_BUILD_ENCODER)
  htvm_floor(c SOURCES src/c_api/c_encoder.cpp LINKS htvm_c_decoder htvm_encoder)
endif()

# The examples, in C99: they check that the header is C, and that a C program can link the library.
if(HTVM_BUILD_TESTS AND HTVM_BUILD_ENCODER)
  enable_language(C)
  foreach(example encode decode)
    add_executable(example_${example} examples/${example}.c)
    set_target_properties(example_${example} PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF)
  endforeach()
  target_link_libraries(example_encode PRIVATE htvm_c)
  target_link_libraries(example_decode PRIVATE htvm_c_decoder)
endif()
