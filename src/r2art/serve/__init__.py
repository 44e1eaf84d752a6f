"""The estimate over HTTP: one model, many clients. Needs `pip install 'r2art[serve]'`.

app       the routes; openapi says what they take and give
options   what a request may say besides the photo
upload    the body, never larger or slower than the limits
pool      how many are computed, how many wait
answers   the prediction as JSON, picture, scene or model
problems  what goes wrong, as RFC 9457 problem JSON
log       one line of JSON for every request
run       the server around the app
"""
