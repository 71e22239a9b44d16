// SPDX-License-Identifier: MIT
// What npm and esbuild made of reports/web, inside the program.
#pragma once

#include <string_view>

namespace minescan {

std::string_view page_script();    // draws the page in a browser
std::string_view page_style();     // its style sheet
std::string_view render_script();  // for Node.js: node render.mjs FIGURES.json FOLDER

}  // namespace minescan
