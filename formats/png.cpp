// SPDX-License-Identifier: MIT
#include "formats/png.h"
