/* The page's parts and the viewer's program as read-only data. */
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

  ASSET page_template, page/page.html
  ASSET page_style, page/page.css
  ASSET page_script, page/page.js
  ASSET page_framed_script, page/framed.js
  ASSET page_shading_script, page/shading.js
  ASSET page_toned_still_script, page/toned_still.js
  ASSET page_motion_script, page/motion.js
  ASSET page_player_script, page/player.js
  ASSET viewer_program, viewer_program.gz
  ASSET viewer_license, viewer_license.txt
#if !defined(__APPLE__)
  .section .note.GNU-stack, "", %progbits
#endif
