# SPDX-License-Identifier: Apache-2.0
# sed -E: what doxygen reads in place of a header. Line numbers stay.

# Macros and free functions show only in a file that has a comment of its own.
1s,^.*SPDX.*$,/** @file */,

# Formulas and tables, indented below `///`, keep their columns.
s,^( *///)   ,\1        ,
s,^( *///) (Defined|Defined for|Valid for|Source|Errors|Keys|Basis) {2},\1 <br><b>\2</b> ,

# No quotation.
s,(///<?) >,\1 \\>,

# Comments of the C header.
s,^( *)/\* ([^-]),\1/** \2,
s:([;,]) +/\* :\1 /**< :
