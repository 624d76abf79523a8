/* tetralod: all public headers. */
#ifndef TETRALOD_TETRALOD_H
#define TETRALOD_TETRALOD_H

#include "tetralod/base.h"
#include "tetralod/codec.h"
#include "tetralod/cut.h"
#include "tetralod/draw.h"
#include "tetralod/extract.h"
#include "tetralod/formats.h"
#include "tetralod/live.h"
#include "tetralod/measure.h"
#include "tetralod/mesh.h"
#include "tetralod/model.h"
#include "tetralod/scene.h"
#include "tetralod/segment.h"
#include "tetralod/simplify.h"
#include "tetralod/store.h"
#include "tetralod/view.h"

#endif
