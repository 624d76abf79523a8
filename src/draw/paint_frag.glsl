/* A surface at one pixel. */
in vec3 normal, at; /* right, up, forward */
in float value;

void main()
{
    vec3 seen = color_of(value);
    if (lit) seen = lighten(seen, cosine_of(normal, parallel ? vec3(0.0, 0.0, 1.0) : at));
    if ((opacity < 1.0) != translucent) discard;
    put(seen, opacity, at.z);
}
