/* A point at one pixel, as in draw_points.c: a disc, or a sphere where there are no normals, that
 * covers pixels at its edge in part. */
uniform bool has_normals;

flat in vec4 disc;
flat in vec3 normal;
flat in float value;

void main()
{
    float away = length(gl_FragCoord.xy - pixel_middle - disc.xy), share = away / disc.w;
    float covered = min(disc.w + 0.5 - away, 1.0), z = disc.z;
    float inward = share < 1.0 ? sqrt(1.0 - share * share) : 0.0;
    vec3 seen = color_of(value);
    if (!has_normals) z -= disc.w * (parallel ? 1.0 : disc.z) / scale * inward;
    if (lit) seen = lighten(seen, has_normals ? cosine_of(normal, view_of(disc.xy)) : inward);
    float alpha = opacity * covered;
    if (!(covered > 0.0) || (alpha < 1.0) != translucent) discard;
    put(seen, alpha, z);
}
