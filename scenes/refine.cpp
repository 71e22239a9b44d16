// SPDX-License-Identifier: MIT
#include "scenes/refine.h"
