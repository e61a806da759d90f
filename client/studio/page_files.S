/* The studio's page as read-only data. */
#if defined(__APPLE__)
#define SYMBOL(name) _##name
  .const
#else
#define SYMBOL(name) name
  .section .rodata
#endif
  .macro ASSET name, file
  .globl SYMBOL(color3d_\name\()_begin)
SYMBOL(color3d_\name\()_begin):
  .incbin "\file"
  .globl SYMBOL(color3d_\name\()_end)
SYMBOL(color3d_\name\()_end):
  .byte 0
  .endm

  ASSET studio_page, studio.html
  ASSET studio_style, studio.css
  ASSET studio_script, studio.js
#if !defined(__APPLE__)
  .section .note.GNU-stack, "", %progbits
#endif
