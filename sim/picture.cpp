// SPDX-License-Identifier: MIT
#include "sim/picture.h"
