/** Open the desk at the place that the address names: the part after # is not sent to the server. */

location.replace(`/open${location.hash}`);
