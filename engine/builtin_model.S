// models/small.vnr as read-only data (engine/builtin_model.cpp).
    .section .rodata
    .balign 64
    .global vnreg_builtin_model_begin
    .hidden vnreg_builtin_model_begin
vnreg_builtin_model_begin:
    .incbin VNREG_BUILTIN_MODEL
    .global vnreg_builtin_model_end
    .hidden vnreg_builtin_model_end
vnreg_builtin_model_end:
    .section .note.GNU-stack, "", %progbits
