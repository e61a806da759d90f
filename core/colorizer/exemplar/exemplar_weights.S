/* weights.safetensors as read-only data of the program. */
#if defined(__APPLE__)
#define SYMBOL(name) _##name
  .const
#else
#define SYMBOL(name) name
  .section .rodata
#endif
  .balign 64
  .globl SYMBOL(color3d_exemplar_weights_begin)
SYMBOL(color3d_exemplar_weights_begin):
  .incbin "core/colorizer/exemplar/weights.safetensors"
  .globl SYMBOL(color3d_exemplar_weights_end)
SYMBOL(color3d_exemplar_weights_end):
  .byte 0
#if !defined(__APPLE__)
  .section .note.GNU-stack, "", %progbits
#endif
