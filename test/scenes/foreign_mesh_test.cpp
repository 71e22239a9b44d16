// SPDX-License-Identifier: MIT
#include "scenes/foreign_mesh.h"
