// SPDX-License-Identifier: MIT
// The assembler copies the files into the object: a megabyte as a C++ array would take the compiler
// half a minute. MINESCAN_WEB is the folder of the bundles.
#include "reports/assets.h"

#define MINESCAN_ASSET(name, path) \
  asm(".section .rodata\n"         \
      ".global minescan_" #name    \
      "_begin\n"                   \
      ".global minescan_" #name    \
      "_end\n"                     \
      "minescan_" #name            \
      "_begin:\n"                  \
      ".incbin \"" path            \
      "\"\n"                       \
      "minescan_" #name            \
      "_end:\n"                    \
      ".previous\n");              \
  extern "C" const char minescan_##name##_begin[], minescan_##name##_end[];

MINESCAN_ASSET(page_script, MINESCAN_WEB "/page.js")
MINESCAN_ASSET(page_style, MINESCAN_WEB "/page.css")
MINESCAN_ASSET(render_script, MINESCAN_WEB "/render.mjs")

namespace minescan {

std::string_view page_script() { return {minescan_page_script_begin, minescan_page_script_end}; }
std::string_view page_style() { return {minescan_page_style_begin, minescan_page_style_end}; }
std::string_view render_script() {
  return {minescan_render_script_begin, minescan_render_script_end};
}

}  // namespace minescan
