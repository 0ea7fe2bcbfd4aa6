# htvm_embed(OUT SYMBOL PATH): declarations in C++ of `const char SYMBOL[], SYMBOL_end[]`, the file's bytes, which the
# assembler copies into the program. The source that has them depends on the file (OBJECT_DEPENDS).
function(htvm_embed out symbol path)
  set(section ".section .rodata")
  set(back ".previous")
  set(prefix "")
  if(WIN32)
    set(section ".section .rdata,\\\"dr\\\"")
    set(back ".text")
  elseif(APPLE)
    set(section ".section __DATA,__const")
    set(back ".text")
    set(prefix "_")
  endif()
  set(${out} "extern \"C\" const char ${symbol}[], ${symbol}_end[];
__asm__(\"${section}\\n.global ${prefix}${symbol}, ${prefix}${symbol}_end\\n\"
        \"${prefix}${symbol}:\\n.incbin \\\"${path}\\\"\\n${prefix}${symbol}_end:\\n.byte 0\\n${back}\");
" PARENT_SCOPE)
endfunction()
