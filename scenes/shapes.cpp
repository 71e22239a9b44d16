// SPDX-License-Identifier: MIT
#include "scenes/shapes.h"
