/* The line of a ray and the corners of a face: from the ray they are seen at x and y, which are 0 on
 * it. Products of two corners are the same, but for their sign, for both faces at an edge: no ray is
 * lost between them. */

/* A vertex from the ray of a pixel's place (px, py). */
vec4 beside(vec4 vert, vec2 pixel)
{
    precise float w = parallel ? 1.0 : vert.z;
    precise vec2 at = vert.xy - pixel * w;
    return vec4(at, vert.zw);
}

/* Double area of the triangle between the ray and two corners. */
float area_of(vec4 a, vec4 b)
{
    precise float area = a.x * b.y - b.x * a.y;
    return area;
}

/* Corners of the face of a tet opposite to one. */
uvec3 face_of(uvec4 tet, uint face)
{
    return face == 0u ? tet.yzw : face == 1u ? tet.xwz : face == 2u ? tet.xyw : tet.xzy;
}
