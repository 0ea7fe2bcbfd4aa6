# The C interface (htvm/htvm.h): the decoder's part, which needs the standard library alone, and with it the encoder's.
htvm_floor(c_decoder SOURCES src/c_api/c_status.cpp src/c_api/c_decoder.cpp LINKS htvm_decoder)
htvm_floor(c SOURCES src/c_api/c_encoder.cpp LINKS htvm_c_decoder htvm_encoder)
